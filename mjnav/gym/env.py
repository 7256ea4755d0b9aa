"""A run as a Gymnasium environment: one episode is one run, one step one control period."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import hypot
from time import monotonic, sleep
from typing import Annotated, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate
from gymnasium.wrappers import TimeLimit
from numpy.typing import ArrayLike, NDArray

from mjnav.control.parameters import LoopParameters
from mjnav.control.policy import Actions, Encoder, Features
from mjnav.errors import InvalidValue, unknown_name
from mjnav.gym.reward import PUBLISHED, Reward, Transition
from mjnav.loop.events import COLLISION, GOAL
from mjnav.loop.prepare import load_scenario
from mjnav.loop.simulation import Simulation
from mjnav.messages import LARGEST, WorldState, finite
from mjnav.robot.controller import num_samples
from mjnav.scene.load import with_seed
from mjnav.scene.overrides import Overrides
from mjnav.scene.prediction import ConstantVelocityModel, Prediction
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, below, settled
from mjnav.world.engine import DivergedError
from mjnav.world.render import Renderer
from mjnav.world.viewer import Viewer, has_display

Side = Annotated[int, Range(1, 4096, "pixels")]  # of a picture
MAX_DRAWN_SEED = 2**31  # of an episode whose reset names none

Blocks = dict[str, NDArray[np.float32]]
Step = tuple[Blocks, float, bool, bool, dict[str, Any]]


class SceneEnv(gymnasium.Env[Blocks, NDArray[Any]]):
    """A scene, step by step.

    `scene` is a shipped name, a run file or a Scenario, and `overrides` are values by dotted key for the first two, as
    in `mjnav.load_scenario`. `features` are the blocks that are observed, by name or as `Features`;
    `mjnav.control.policy` says what stands in them, and the truth is never among them. `actions` is
    "normalised", from -1 to 1 over the robot's limits, or "si", (v [m/s], omega [rad/s]). `reward` has the weights of
    the terms of `mjnav.gym.reward`. `size` is a picture's (width, height) in pixels.

    The seed of `reset` is the run's: the same commands give the run of `mjnav run --seed`, state hash and all. Without
    one an episode draws its seed from the environment's own generator; `info["seed"]` has it.
    `options={"scene": ...}` runs another scene from this reset on, of a robot with the same limits.

    The instance's `metadata` names the render modes of this machine: "human", a window, needs a display.

    An episode is terminated by the goal and by a collision, truncated by the time limit and where the physics
    diverge. What a class of the user's own breaks is raised as a PluginFault.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 10}  # noqa: RUF012 - as in Env

    def __init__(
        self,
        scene: str | os.PathLike[str] | Scenario,
        *,
        overrides: Overrides = (),
        features: Features | Sequence[str] = ("robot", "people"),
        actions: str = "normalised",
        reward: Mapping[str, float] = PUBLISHED,
        render_mode: str | None = None,
        size: tuple[int, int] = (640, 360),
    ):
        """Raises InvalidValue for anything that cannot be used."""
        if overrides and isinstance(scene, Scenario):
            raise InvalidValue("overrides", overrides, "none beside a Scenario: load_scenario takes them")
        self._overrides = overrides
        self._scenario = self._load(scene)
        self._features = Features.of(features)
        limits = self._scenario.robot.limits
        self._encoder, self._actions, self._reward = Encoder(self._features, limits), Actions(limits), Reward(reward)
        if actions not in ("normalised", "si"):
            raise unknown_name("actions", actions, ("normalised", "si"))
        self._normalised = actions == "normalised"
        self._check_scan(self._scenario)

        self.observation_space: spaces.Space[Any] = spaces.Dict(
            {name: spaces.Box(low, high, dtype=np.float32) for name, (low, high) in self._encoder.bounds.items()}
        )
        if self._normalised:
            self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        else:  # in double precision, as commands are
            self.action_space = spaces.Box(self._actions.low, self._actions.high, dtype=np.float64)
        modes = [mode for mode in self.metadata["render_modes"] if mode != "human" or has_display()]
        if render_mode is not None and render_mode not in modes:
            also = "" if "human" in modes else "human where there is a display (DISPLAY, WAYLAND_DISPLAY)"
            raise unknown_name("render_mode", render_mode, modes, also=also)
        self.render_mode = render_mode
        self.metadata = {"render_modes": modes, "render_fps": max(1, round(self._scenario.control.rate))}
        with below("size"):
            self._size = settled(tuple[Side, Side], size)
        self._renderer: Renderer | None = None
        self._window: Viewer | None = None
        self._due = 0.0  # [s] of the clock, when the window shows the next state
        self._simulation: Simulation | None = None
        self._stepped: Step | None = None  # what the next `step` returns, where its parts have been taken already

    @property
    def simulation(self) -> Simulation:
        """The run of the present episode, with the truth. Raises ResetNeeded before the first `reset`."""
        if self._simulation is None:
            raise ResetNeeded("reset() comes before the first step")
        return self._simulation

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Blocks, dict[str, Any]]:
        """A new episode; see the class for `seed` and `options`. Raises InvalidValue for what it cannot use."""
        if options is not None and not isinstance(options, Mapping):
            raise InvalidValue("options", options, "a mapping, {'scene': ...}")
        scenario = self._scenario
        for name, value in (options or {}).items():
            if name != "scene":
                raise unknown_name("options", name, ("scene",))
            scenario = self._another(value)
        own_seed = int(self.np_random.integers(MAX_DRAWN_SEED)) if seed is None else seed
        scenario = with_seed(scenario, own_seed)
        simulation = Simulation(scenario, scan="scan" in self._features.blocks)
        super().reset(seed=seed)
        if options or scenario.draft is not None:  # other walls, people and goal
            self._end_pictures()
        self._scenario, self._simulation, self._stepped = scenario, simulation, None  # all or nothing
        self._command = np.zeros(2)
        self._trail = [simulation.state.robot_pose[:2]]
        self._show()
        info = {"seed": own_seed, "time_s": 0.0, "distance_to_goal_m": self._distance(simulation.state)}
        return self._observe(), info

    def step(self, action: ArrayLike) -> Step:
        """One control period under `action`.

        `info` has the time, the distance to the goal and the least clearance from people in this step, all of the
        truth, each reward term times its weight, and after the last step, as "summary", what `mjnav run --json` prints.
        Where the physics diverge the episode is truncated, and "fault" says so.
        Raises InvalidValue for an action that is no two finite numbers, and ResetNeeded after the last step.
        """
        if self._stepped is None:
            for _ in self.parts(action):
                pass
        stepped, self._stepped = self._stepped, None
        assert stepped is not None, "parts() ends with it"
        return stepped

    def parts(self, action: ArrayLike) -> Iterator[None]:
        """A step in parts, for who takes many worlds through each part before the next; `step` then returns it."""
        self._stepped = None
        simulation = self.simulation
        if simulation.done:
            raise ResetNeeded("the episode has ended: reset() begins another")
        command = finite("action", action, 2, most=LARGEST)
        if self._normalised:
            command = self._actions.command(command)
        yield
        before, target = simulation.state, simulation.goal
        fault = None
        try:
            simulation.step(*command.tolist())
        except DivergedError as error:  # the simulation has ended as aborted
            fault = str(error)
        yield
        after, outcome = simulation.state, simulation.outcome
        step = Transition(self._scenario, before, after, target, self._command, command, outcome)
        terms = self._reward.terms(step)
        self._command = command
        self._trail.append(after.robot_pose[:2])
        self._show()
        info: dict[str, Any] = {
            "time_s": after.time,
            "distance_to_goal_m": self._distance(after),
            "clearance_m": step.clearance,
            "reward_terms": terms,
        }
        if simulation.done:
            info["summary"] = simulation.summary
        if fault is not None:
            info["fault"] = fault
        terminated = outcome in (GOAL, COLLISION)
        yield
        simulation.perceive()
        yield
        simulation.predict()
        yield
        self._stepped = self._observe(), sum(terms.values()), terminated, simulation.done and not terminated, info
        yield

    def render(self) -> NDArray[np.uint8] | None:
        """With `render_mode` rgb_array the scene as it is, (height, width, 3); the window of "human" follows by itself.

        Raises InputError where nothing can be drawn without a screen.
        """
        if self.render_mode != "rgb_array":
            return None
        if self._renderer is None:
            floor = np.array([self._scenario.robot.start[:2], *(person.start for person in self._scenario.people)])
            self._renderer = Renderer(self._scenario, floor, size=self._size, quick=True)
        return self._renderer.draw(self.simulation.truth, trail=self._trail)

    def close(self) -> None:
        """Frees the picture's memory, or closes the window."""
        self._end_pictures()

    def _observe(self) -> Blocks:
        return self._encoder.encode(self.simulation.predict())

    def _distance(self, truth: WorldState) -> float:
        return hypot(*(truth.robot_pose[:2] - self._scenario.robot.route[-1]).tolist())

    def _show(self) -> None:
        """Shows the state in the window one control period after the one before, or at once where that is past."""
        if self.render_mode != "human":
            return
        if self._window is None:
            self._window = Viewer(self._scenario)
        if len(self._trail) == 1:
            self._window.forget_trail()
            self._due = monotonic()
        sleep(max(self._due - monotonic(), 0.0))
        self._due = max(self._due, monotonic()) + self._scenario.control.period
        self._window.show(self.simulation.truth)

    def _load(self, scene: str | os.PathLike[str] | Scenario) -> Scenario:
        return _for_a_policy(scene if isinstance(scene, Scenario) else load_scenario(scene, self._overrides))

    def _another(self, scene: str | os.PathLike[str] | Scenario) -> Scenario:
        scenario = self._load(scene)
        limits, present = scenario.robot.limits, self._scenario.robot.limits
        if limits != present:
            raise InvalidValue("options.scene.robot", limits, f"a robot with the environment's limits: {present}")
        self._check_scan(scenario)
        return scenario

    def _check_scan(self, scenario: Scenario) -> None:
        beams = len(scenario.sensors.scanner.angles)
        if "scan" in self._features.blocks and self._features.beams > beams:
            raise InvalidValue("features.beams", self._features.beams, f"at most the lidar's beams ({beams})")

    def _end_pictures(self) -> None:
        for picture in (self._renderer, self._window):
            if picture is not None:
                picture.close()
        self._renderer = self._window = None


class VectorSceneEnv(SyncVectorEnv):
    """`num_envs` worlds in one process, each with the bits of a single `SceneEnv` made with the same `options`.

    All take the first part of a step, then all the next: the processor's caches hold the code of one part, not of a
    whole step, which takes a seventh less time.
    """

    def __init__(
        self,
        num_envs: int,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **options: Any,
    ):
        """An episode is truncated after `max_episode_steps`, as by `gymnasium.make`."""

        def made() -> gymnasium.Env:
            env = SceneEnv(**options)
            return env if max_episode_steps is None else TimeLimit(env, max_episode_steps)

        super().__init__([made] * num_envs, autoreset_mode=autoreset_mode)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """See `gymnasium.vector.VectorEnv`. An action that cannot be used is refused before any world moves."""
        rows = zip([env.unwrapped for env in self.envs], iterate(self.action_space, actions), strict=True)
        running = [env.parts(action) for env, action in rows if not env.simulation.done]  # type: ignore[attr-defined]
        for _ in zip(*running, strict=True):
            pass
        return super().step(actions)


def _for_a_policy(scenario: Scenario) -> Scenario:
    """The scenario with the samples of each belief and the prediction of people that a policy has as a controller.

    Where it does not say them: the method that it names may have others by default, and decides nothing here.
    """
    scenario = replace(scenario, prediction=scenario.prediction or Prediction(ConstantVelocityModel()))
    control, num = scenario.control, LoopParameters().samples
    if "samples" in control.parameters or num_samples(scenario) in (None, num):
        return scenario
    return replace(scenario, control=replace(control, parameters={**control.parameters, "samples": num}))

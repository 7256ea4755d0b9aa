"""Risk calibration: the predicted share of colliding samples at the chosen control, against the observed frequency.

The event whose risk is predicted is the same for all methods, whatever form, margin and horizon they use:

    the robot, at the velocity that its control gives it, and the discs, at theirs, touch within 5 s:
    f > 0 for any person, leg or pillar, f in the segment form with R the sum of the radii (no margin).

The robot's velocity is the candidates': (v + dv) [cos(theta + (omega + domega) tau), sin(...)], tau = 0.4 s. Walls are
left out: they have a horizon of their own.

Rollouts say how often a control collides if the robot keeps it and people keep their velocities. From the true state
the robot accelerates to (v, omega) within its limits and keeps it for the event's 5 s: an arc, where the candidates'
cone has a straight line. Each draw of the actuation noise holds for 0.1 s, as in the world. People walk straight on at
their true velocities; neither contacts nor walls stop anybody.

Observations drawn around the true state take the place of a filter's belief. State = truth - error, as a belief is a
reading minus its noise; the errors are the world's noise channels:

    robot   x, y, theta   pose.x, pose.y, pose.theta
    control dv, domega    actuation.v, actuation.omega (added, not subtracted)
    person  x, y          detection.x, detection.y
    person  vx, vy        detection.x, detection.y over 1 s: a velocity is a slope of detections in a second, and its
                          error has about that size (0.95 of it for least squares at 10 Hz)

The predicted share and the observed frequency are probabilities of the event, taken at every k-th decision along runs
of the method:

    direct     The method decides on N = M samples drawn around the true state (`around_truth`) at the moment when the
               run's decision took effect. Its prediction is the share of colliding pairs, against fresh draws from the
               same distributions. Errors come from few samples, and from choosing a control for which they look good.
    filtered   The run's own decision on the filters' samples, against the event from the true state at the moment of
               effect, with fresh draws of the actuation noise. Errors come from the beliefs as well.
    rollout    The same forecast, against rollouts from that state (`share_of_rollouts`): the control kept as an arc,
               noise that changes every 0.1 s. Errors come from the candidates' model of motion as well.

The fresh draws are made once a run and shared by its decisions. A decision that never takes effect does not count.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.constraints.collision_cone import collision_cone, cone_segment
from mjnav.control.parameters import Parameters
from mjnav.control.problem.problem import Problem
from mjnav.errors import InvalidValue
from mjnav.geometry.angles import wrap
from mjnav.loop.episode import Episode
from mjnav.messages import Array, Decision, Observation, ObstacleSamples, RobotLimits, TickRecord, WorldState
from mjnav.metrics.prediction import Calibration, calibration
from mjnav.motion.unicycle import ramp_mean
from mjnav.noise import NOISE_WINDOW, Distribution
from mjnav.rng import stream
from mjnav.robot.controller import build_controller
from mjnav.scene.load import with_seed
from mjnav.scene.spec import Scenario

# ---------------------------------------------------------------------------------------------- event


# The methods' shared defaults; every disc counts.
EVENT = Parameters(safety_margin=0.0, sensing_range=inf, max_obstacles=1_000_000)


def share_of_pairs(observation: Observation, control: tuple[float, float], limits: RobotLimits) -> float:
    """The probability of the event by an observation's samples: the prediction of a method that uses them all.

    Robot samples are equally likely and obstacles independent of one another: with s_ij the share of obstacle j's
    samples that robot sample i hits, it is the mean over i of 1 - prod_j (1 - s_ij).
    """
    # Without candidates, the period has no effect.
    problem = Problem(replace(observation, walls=np.zeros((0, 2, 2))), limits, 1.0, EVENT)
    v, omega = np.array([control[0]]), np.array([control[1]])
    num = len(observation.robot_pose)
    missed = np.ones(num)
    for block in range(problem.cone.blocks.num_discs):
        f = problem.cone.samples(block, v, omega).reshape(-1, num)  # the robot's samples run fastest
        missed *= (f <= 0.0).mean(axis=0)
    return float(1.0 - missed.mean())


def share_of_draws(observation: Observation, control: tuple[float, float], limits: RobotLimits) -> float:
    """The share of joint draws in which the event happens: draw i is row i of all samples (each n or 1)."""
    pose, noise = observation.robot_pose, observation.control_noise
    heading = pose[:, 2] + (control[1] + noise[:, 1]) * EVENT.preview
    velocity = (control[0] + noise[:, :1]) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    hit = np.zeros(len(velocity), bool)
    for disc in observation.obstacles:
        f = collision_cone(
            pose[:, :2] - disc.position,
            velocity - disc.velocity,
            limits.radius + disc.radius,
            form=EVENT.form,
            horizon=EVENT.horizon,
        )
        hit |= f > 0.0
    return float(hit.mean())


# ------------------------------------------------------------------------------------------- rollouts


NUM_WINDOWS = round(EVENT.horizon / NOISE_WINDOW)


@kernel
def _num_hits(
    x0: float,
    y0: float,
    heading0: float,
    twist: Matrix,
    noise: Cube,
    ox: Vector,
    oy: Vector,
    ovx: Vector,
    ovy: Vector,
    radius: Vector,
    window: float,
):
    """The number of rollouts, one for each row of `noise` (n, S, 2), that come nearer to a disc than its R."""
    hits = 0
    for i in range(noise.shape[0]):
        x, y, heading, hit = x0, y0, heading0, False
        for s in range(noise.shape[1]):
            # The exact arc of a window; the cone sees its chord, which is off by v omega T^2 / 8, at most 2 mm.
            half = 0.5 * window * (twist[s, 1] + noise[i, s, 1])
            speed = (twist[s, 0] + noise[i, s, 0]) * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
            vx, vy = speed * np.cos(heading + half), speed * np.sin(heading + half)
            time = s * window
            for j in range(ox.size):
                rx, ry = x - (ox[j] + time * ovx[j]), y - (oy[j] + time * ovy[j])
                hit |= cone_segment(rx, ry, vx - ovx[j], vy - ovy[j], radius[j] * radius[j], window) > 0.0
            if hit:
                break
            x += window * vx
            y += window * vy
            heading += 2.0 * half
        hits += hit
    return hits


def share_of_rollouts(truth: Observation, control: tuple[float, float], limits: RobotLimits, noise: Array) -> float:
    """The share of rollouts that touch a person, leg or pillar.

    `truth` is an observation with one pose and one state of each obstacle; its twist is the command before `control`.
    `noise` (n, S, 2) is the actuation noise of n rollouts in S windows of 0.1 s.
    """
    twist, before = np.empty((noise.shape[1], 2)), truth.twist
    for s in range(len(twist)):
        twist[s], before = ramp_mean(before, control, limits, NOISE_WINDOW)
    x, y, heading = truth.robot_pose[0].tolist()
    position = np.array([disc.position[0] for disc in truth.obstacles]).reshape(-1, 2)
    velocity = np.array([disc.velocity[0] for disc in truth.obstacles]).reshape(-1, 2)
    radius = np.array([limits.radius + disc.radius for disc in truth.obstacles])
    columns = [np.ascontiguousarray(a) for a in (*position.T, *velocity.T)]
    return _num_hits(x, y, heading, twist, noise, *columns, radius, NOISE_WINDOW) / len(noise)


# ----------------------------------------------------------------------------- draws around the truth


VELOCITY_WINDOW = 1.0  # [s] of detections behind a velocity
_ROBOT = ("pose.x", "pose.y", "pose.theta")
_CONTROL = ("actuation.v", "actuation.omega")
_PERSON = ("detection.x", "detection.y")


@dataclass(frozen=True, slots=True)
class Errors:
    """n joint draws of all errors; a single row holds for all n."""

    pose: Array  # (n, 3) or (1, 3)
    control: Array  # (n, 2)
    people: Array  # (P, n, 4) or (P, 1, 4)

    @classmethod
    def of_control(cls, control: Array, num_people: int) -> "Errors":
        """A known state under actuation noise (n, 2)."""
        return cls(np.zeros((1, 3)), control, np.zeros((num_people, 1, 4)))


class ErrorDraws:
    """Draws errors from the random streams of a `use`: "sample" for a controller, "fresh" to compare it with."""

    def __init__(self, scenario: Scenario, seed: int, use: str):
        noise = scenario.noise.distributions()

        def channels(names: Sequence[str], body: str, what: str = "") -> list[tuple[Distribution, np.random.Generator]]:
            return [(noise[name], stream(seed, f"calibration.{use}.{name}{what}", body)) for name in names]

        people = [f"person{i}" for i in range(len(scenario.people))]
        self._pose, self._control = channels(_ROBOT, "robot"), channels(_CONTROL, "robot")
        self._position = [channels(_PERSON, person) for person in people]
        self._velocity = [channels(_PERSON, person, ".velocity") for person in people]

    def __call__(self, num: int) -> Errors:
        """`num` joint draws."""
        people = np.zeros((len(self._position), num, 4))
        for person, position, velocity in zip(people, self._position, self._velocity, strict=True):
            person[:, :2] = _columns(position, num)
            person[:, 2:] = _columns(velocity, num) / VELOCITY_WINDOW
        return Errors(_columns(self._pose, num), self.control(num), people)

    def control(self, *size: int) -> Array:
        """Draws of the actuation noise alone, (*size, 2)."""
        return _columns(self._control, *size)


def _columns(channels: Sequence[tuple[Distribution, np.random.Generator]], *size: int) -> Array:
    return np.stack([distribution.sample(rng, size) for distribution, rng in channels], axis=-1)


def around_truth(observation: Observation, truth: WorldState, errors: Errors) -> Observation:
    """The observation with robot and people at their true states minus the errors; the rest stays."""
    present = np.flatnonzero(~np.isnan(truth.people_position[:, 0]))
    num = len(errors.control)
    pose = np.broadcast_to(truth.robot_pose - errors.pose, (num, 3)).copy()
    pose[:, 2] = wrap(pose[:, 2])
    people = [
        ObstacleSamples(
            truth.people_position[p] - errors.people[p, :, :2],
            truth.people_velocity[p] - errors.people[p, :, 2:],
            person.radius,
        )
        for p, person in zip(present, observation.obstacles, strict=False)
    ]
    return replace(
        observation,
        robot_pose=pose,
        control_noise=errors.control,
        obstacles=(*people, *observation.obstacles[len(present) :]),
        time=truth.time,
    )


# ---------------------------------------------------------------------------------------- calibration


SETTINGS = ("direct", "filtered", "rollout")
Control = tuple[float, float]  # v [m/s], omega [rad/s]


@dataclass(frozen=True, slots=True)
class CalibrationPlan:
    """The number of fresh draws for each decision, and `every`: each k-th tick's decision counts."""

    draws: int = 100_000
    every: int = 5

    def __post_init__(self):
        for key in ("draws", "every"):
            if getattr(self, key) < 1:
                raise InvalidValue(key, getattr(self, key), "a whole number >= 1")


class ForecastRecorder:
    """Watches a run, and compares every k-th decision with the truth when it takes effect."""

    def __init__(self, scenario: Scenario, plan: CalibrationPlan):
        self._scenario, self._every = scenario, plan.every
        self._controller = build_controller(scenario)
        self._sample = ErrorDraws(scenario, scenario.seed, "sample")
        self._fresh = ErrorDraws(scenario, scenario.seed, "fresh")(plan.draws)
        rollouts = ErrorDraws(scenario, scenario.seed, "rollout")
        self._rollout_noise = rollouts.control(plan.draws, NUM_WINDOWS)  # (n, S, 2)
        self._waiting: deque[TickRecord] = deque()
        self.forecasts: dict[str, list[tuple[float, float]]] = {setting: [] for setting in SETTINGS}

    def __call__(self, record: TickRecord) -> None:
        """One more tick."""
        if record.tick % self._every == 0:
            self._waiting.append(record)
        if self._waiting and self._waiting[0].tick + self._scenario.control.delay == record.tick:
            decided = self._waiting.popleft()
            for setting, forecast in zip(SETTINGS, self._compared(decided, record.truth), strict=True):
                self.forecasts[setting].append(forecast)

    def _compared(self, decided: TickRecord, truth: WorldState) -> Iterator[tuple[float, float]]:
        """Predicted share and frequency in each of SETTINGS; `truth` is the state when the decision takes effect."""
        limits, seen, num_people = self._scenario.robot.limits, decided.seen, len(truth.people_position)

        def frequency(errors: Errors, control: Control) -> float:
            return share_of_draws(around_truth(seen, truth, errors), control, limits)

        sampled = around_truth(seen, truth, self._sample(self._controller.parameters.samples))
        control = _control(self._controller.decide(sampled))
        yield share_of_pairs(sampled, control, limits), frequency(self._fresh, control)

        control = _control(decided.decision)
        predicted = share_of_pairs(seen, control, limits)
        yield predicted, frequency(Errors.of_control(self._fresh.control, num_people), control)

        known = around_truth(seen, truth, Errors.of_control(np.zeros((1, 2)), num_people))
        yield predicted, share_of_rollouts(known, control, limits, self._rollout_noise)


def _control(decision: Decision) -> Control:
    return decision.v, decision.omega


def forecasts(
    scenario: Scenario, plan: CalibrationPlan, *, progress: Callable[[float], None] = lambda time: None
) -> dict[str, Array]:
    """Predicted share and frequency of the decisions of one run, (n, 2) by setting; `progress` is as in `Episode`."""
    recorder = ForecastRecorder(scenario, plan)
    Episode(scenario, watch=recorder, progress=progress).run()
    return {setting: np.array(pairs, float).reshape(-1, 2) for setting, pairs in recorder.forecasts.items()}


def calibrate(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    plan: CalibrationPlan,
    *,
    watched: Callable[[Scenario], AbstractContextManager[Callable[[float], None]]] = lambda run: nullcontext(_no_beat),
    progress: Callable[[int], None] = lambda done: None,
) -> dict[str, dict[str, Calibration]]:
    """The calibration by method and setting, from a run of every scenario (one for each method) under every seed.

    `watched` gives the context of a run, and what it calls before every tick; `progress` gets the number of runs that
    are done. Raises InputError before anything starts, and MjnavError where a run breaks.
    """
    runs: list[dict[str, Array]] = []
    for run in [with_seed(scenario, seed) for scenario in scenarios for seed in seeds]:
        with watched(run) as beat:
            runs.append(forecasts(run, plan, progress=beat))
        progress(len(runs))
    by_method: dict[str, dict[str, Calibration]] = {}
    for i, scenario in enumerate(scenarios):
        of_method = runs[i * len(seeds) : (i + 1) * len(seeds)]
        by_method[scenario.control.method] = {
            setting: _calibration([run[setting] for run in of_method], seeds) for setting in SETTINGS
        }
    return by_method


def _no_beat(time: float) -> None:
    """Of a run that is not watched."""


def _calibration(runs: Sequence[Array], seeds: Sequence[int]) -> Calibration:
    predicted, observed = np.concatenate(runs).T
    groups = np.repeat(seeds, [len(run) for run in runs])
    return calibration(predicted, observed, groups, stream(int(seeds[0]), "calibration.bootstrap"))

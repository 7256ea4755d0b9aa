"""The environments: runs, step by step, under Gymnasium's rules."""

import json
import subprocess
from importlib.metadata import entry_points

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mjnav
from mjnav import load_scenario
from mjnav.control.policy import Features, PolicyController, flatten
from mjnav.errors import InvalidValue
from mjnav.gym import SceneEnv, register

QUICK = ("physics.engine=kinematic", "time_limit=2")


def scene(name: str = "crossing1", *overrides: str, **options) -> gymnasium.Env:
    return gymnasium.make("mjnav/Scene-v0", scene=name, overrides=(*QUICK, *overrides), **options)


def driven(env: gymnasium.Env, action, **reset) -> list[tuple]:
    """What every step of an episode returned, under one action."""
    env.reset(**reset)
    steps = []
    while not steps or not (steps[-1][2] or steps[-1][3]):
        steps.append(env.step(np.array(action, np.float32)))
    return steps


def driven_by_its_own_controller(*overrides: str) -> str:
    """The state hash of hall, seed 3, driven through the environment by the decisions of its simulation."""
    with gymnasium.make("mjnav/Hall-v0", actions="si", overrides=overrides) as env:
        env.reset(seed=3)
        simulation, done = env.unwrapped.simulation, False
        while not done:
            decision = simulation.decide()
            *_, terminated, truncated, info = env.step(np.array([decision.v, decision.omega]))
            done = terminated or truncated
    return info["summary"]["state_hash"]


def test_the_scenes_own_controller_through_the_environment_gives_the_run_of_the_command_line(forked):
    command = [*forked, "run", "hall", "--seed", "3", "--controller", "rkhs", "--no-log", "--json"]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    assert driven_by_its_own_controller("control.method=rkhs") == json.loads(said.stdout)["state_hash"]
    own = ("control.samples=48", "prediction.model=walls")  # that a policy has others of
    overrides = ("physics.engine=kinematic", "time_limit=4", *own)
    assert load_scenario("hall").control.method == "rkhs-plan"
    result = mjnav.run(load_scenario("hall", overrides, seed=3))
    assert driven_by_its_own_controller(*overrides) == result.summary["state_hash"]


def test_it_keeps_gymnasiums_rules_and_without_a_display_offers_no_window(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with scene(features=("grid", "scan")) as env:
        check_env(env.unwrapped, skip_render_check=True)
    with scene(size=(96, 54)) as env:
        assert env.unwrapped.metadata["render_modes"] == ["rgb_array"]
        check_env(env.unwrapped)
    with pytest.raises(InvalidValue, match=r"found 'human'; allowed: rgb_array; or human where there is a display"):
        SceneEnv("crossing1", render_mode="human")


def test_the_goal_and_a_collision_terminate_and_the_time_limit_truncates():
    ends = {}
    for name, overrides in {
        "goal": ("robot.goal=[0.6, 0]",),
        "collision": ("pillars=[{position = [0.7, 0.0]}]",),
        "timeout": ("time_limit=0.5",),
    }.items():
        with scene("crossing1", *overrides) as env:
            *_, (_, reward, terminated, truncated, info) = driven(env, [1.0, 0.0], seed=0)
        assert info["summary"]["outcome"] == name
        ends[name] = (terminated, truncated, reward)
    assert ends == {"goal": (True, False, 1.0), "collision": (True, False, -0.25), "timeout": (False, True, 0.0)}


def test_a_seed_gives_the_same_episode_and_without_one_info_says_which_was_drawn():
    with scene() as env:
        first, info = env.reset(seed=5)
        assert info["seed"] == 5
        _, drawn = env.reset()
        again, _ = env.reset(seed=5)
        np.testing.assert_array_equal(flatten(first), flatten(again))
        assert env.reset()[1]["seed"] == drawn["seed"] != 5
        other, _ = env.reset()
        assert (flatten(other) != flatten(first)).any()


def test_a_reset_that_fails_changes_nothing():
    with scene() as env, scene() as other:
        for one in (env, other):
            one.reset(seed=5)
        with pytest.raises(InvalidValue, match="seed"):
            env.reset(seed=-1, options={"scene": "hall"})
        with pytest.raises(InvalidValue, match="options"):
            env.reset(seed=7, options={"scene": "hall", "seen": 1})
        for one in (env, other):
            one.step(np.zeros(2, np.float32))
        assert env.unwrapped.simulation.scenario == other.unwrapped.simulation.scenario
        assert env.reset()[1] == other.reset()[1]


class Recording(PolicyController):
    """Drives in a curve and keeps what it saw."""

    features = Features(blocks=("robot", "people", "scan", "grid"), cells=8)
    seen: list = []  # noqa: RUF012

    def act(self, blocks):
        self.seen.append(blocks)
        return self.actions.command(np.array([0.5, 0.1], np.float32))


def test_a_policy_as_a_controller_sees_what_the_environment_showed_bit_for_bit():
    Recording.seen.clear()
    overrides = ("physics.engine=kinematic", "time_limit=1")
    result = mjnav.run(load_scenario("hall", overrides), controller=Recording, seed=4)
    with gymnasium.make("mjnav/Hall-v0", overrides=overrides, features=Recording.features) as env:
        first, _ = env.reset(seed=4)
        steps = driven(env, [0.5, 0.1], seed=4)
    blocks = [first, *(step[0] for step in steps)]
    assert len(Recording.seen) == len(steps) == 10
    for shown, seen in zip(blocks, Recording.seen, strict=False):
        for name in seen:
            np.testing.assert_array_equal(shown[name], seen[name], err_msg=name)
    assert steps[-1][4]["summary"]["state_hash"] == result.summary["state_hash"]


@pytest.mark.parametrize("mode", [None, "sync", "async"])
def test_eight_in_a_vector_are_eight_single_ones(mode):
    options = {"scene": "crossing1", "overrides": (*QUICK, "time_limit=0.3")}
    envs = gymnasium.make_vec("mjnav/Scene-v0", num_envs=8, vectorization_mode=mode, **options)
    try:
        blocks, info = envs.reset(seed=10)
        assert info["seed"].tolist() == list(range(10, 18))
        seen = [blocks["people"][3].tobytes()]
        for _ in range(3):
            blocks, _, _, truncated, info = envs.step(np.full((8, 2), 0.5, np.float32))
            seen.append(blocks["people"][3].tobytes())
        assert truncated.all()
        with gymnasium.make("mjnav/Scene-v0", **options) as env:
            first, _ = env.reset(seed=13)
            blocks = [first, *(one[0] for one in driven(env, [0.5, 0.5], seed=13))]
        assert seen == [block["people"].tobytes() for block in blocks]
        assert info["summary"]["ticks"].tolist() == [3] * 8
        envs.step(np.zeros((8, 2), np.float32))  # begins the next episodes
    finally:
        envs.close()


@pytest.mark.parametrize("mode", [None, "sync"])
def test_a_vectors_episodes_end_after_the_steps_that_make_is_given(mode):
    options = {"scene": "crossing1", "overrides": QUICK, "max_episode_steps": 2}
    envs = gymnasium.make_vec("mjnav/Scene-v0", num_envs=2, vectorization_mode=mode, **options)
    envs.reset(seed=0)
    steps = [envs.step(np.full((2, 2), 0.5, np.float32)) for _ in range(5)]
    assert [truncated.tolist() for *_, truncated, _ in steps] == [[ends] * 2 for ends in (0, 1, 0, 0, 1)]
    assert [info["time_s"][1] for *_, info in steps] == pytest.approx([0.1, 0.2, 0.0, 0.1, 0.2])
    envs.close()


def test_an_action_of_a_vector_that_cannot_be_used_is_refused_before_any_world_moves():
    envs = gymnasium.make_vec("mjnav/Scene-v0", num_envs=2, scene="crossing1", overrides=QUICK)
    envs.reset(seed=0)
    actions = np.zeros((2, 2))
    with pytest.raises(InvalidValue, match=r"^action: found"):
        envs.step(np.array([[0.0, 0.0], [np.nan, 0.0]]))
    assert [env.simulation.tick for env in envs.envs] == [0, 0]
    envs.step(actions)
    assert [env.simulation.tick for env in envs.envs] == [1, 1]
    envs.close()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"scene": "hal"}, "did you mean 'hall'"),
        ({"features": ("robots",)}, "did you mean 'robot'"),
        ({"features": Features(blocks=("scan",), beams=720)}, r"beams: found 720; allowed: at most .* \(360\)"),
        (
            {"scene": load_scenario("crossing1"), "overrides": QUICK},
            "overrides: found .* allowed: none beside a Scenario",
        ),
        ({"size": (0, 64)}, r"size\.0: found 0; allowed: a whole number from 1 to 4096 pixels"),
    ],
)
def test_what_cannot_be_used_is_said_before_anything_starts(wrong, message):
    with pytest.raises(InvalidValue, match=message):
        gymnasium.make("mjnav/Scene-v0", **{"scene": "crossing1", **wrong})


def test_an_action_that_is_no_two_finite_numbers_is_refused_and_changes_nothing():
    with scene() as env:
        env.reset(seed=0)
        for wrong in ([0.7], [np.nan, 0.0], [10**400, 0], "fast", None):
            with pytest.raises(InvalidValue, match=r"^action: found .*; allowed: finite numbers, .* of shape \(2,\)"):
                env.step(wrong)
        assert env.unwrapped.simulation.tick == 0


def test_the_entry_point_registers_the_environments_once():
    (entry,) = entry_points(group="gymnasium.envs", name="mjnav")
    assert entry.load() is register
    register()
    assert {"mjnav/Hall-v0", "mjnav/Scene-v0"} <= set(gymnasium.registry)

"""`mjnav.run`: what it takes, where its log goes, which limits hold; and the tick at a moment."""

import re

import numpy as np
import pytest

import mjnav
from mjnav import scene
from mjnav.errors import InputError, InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import record_at

SHORT = ("time_limit=0.4",)


def test_seed_and_controller_take_the_place_of_the_scenarios_own():
    scenario = load_scenario("crossing1", (*SHORT, "control.degree=3", "control.rate=5"))
    summary = mjnav.run(scenario, seed=7, controller="mean").summary
    assert (summary["seed"], summary["controller"], summary["ticks"]) == (7, "mean", 2)
    other = load_scenario("crossing1", (*SHORT, "control.rate=5"), controller="mean", seed=7)
    assert summary["state_hash"] == mjnav.run(other).summary["state_hash"]
    assert (scenario.seed, scenario.control.method) == (0, "rkhs")


def test_what_cannot_be_used_is_refused_before_anything_starts(tmp_path):
    existing = tmp_path / "a.mcap"
    existing.write_bytes(b"mine")
    with pytest.raises(InputError, match="exists already"):
        mjnav.run("crossing1", log=existing)
    assert existing.read_bytes() == b"mine"
    for seed in (-1, 1.5, "a", np.nan, 10**400):
        with pytest.raises(InvalidValue, match=r"seed: found .*; allowed: (a )?whole number"):
            mjnav.run("crossing1", seed=seed)
    for overrides in (None, 3, [3], {3: 4}, [("a",)], [b"time_limit=1"]):
        with pytest.raises(InvalidValue, match=r"^overrides: found .*; allowed: values by dotted key"):
            load_scenario("crossing1", overrides)
    with pytest.raises(
        InvalidValue, match=r"^scene: found Scenario\(.*; a Scenario needs no loading: mjnav\.run takes"
    ):
        load_scenario(load_scenario("crossing1"))
    with pytest.raises(InvalidValue, match="stop: found 3; allowed: a function"):
        mjnav.run("crossing1", stop=3)


def test_errors_in_a_methods_parameters_name_where_they_came_from(tmp_path):
    with pytest.raises(InvalidValue, match=r"^overrides: control\.degre: .*did you mean 'degree'"):
        load_scenario("crossing1", ("control.degre=2",))
    with pytest.raises(InvalidValue, match=r"^controller: control\.method: "):
        load_scenario("crossing1", controller="rkh")
    path = tmp_path / "mine.toml"
    path.write_text(scene.dumps(load_scenario("crossing1")).replace("[control]", "[control]\ndegre = 2"))
    with pytest.raises(InvalidValue, match=rf"^{re.escape(str(path))}: control\.degre: "):
        load_scenario(path)


@pytest.mark.parametrize("argument", ["controller", "localizer", "tracker", "metrics"])
def test_a_wrong_argument_beside_a_scenario_is_named_and_not_its_file(argument):
    wrong = ["nope.py:Own"] if argument == "metrics" else "nope.py:Own"
    for given in (load_scenario("crossing1"), "crossing1"):
        with pytest.raises(InvalidValue, match=rf"^{argument}: .*: found 'nope.py:Own'"):
            mjnav.run(given, **{argument: wrong})


STILL = {"physics.engine": "kinematic", "time_limit": 2.0, "noise.profile": "none"}
LIMITS = {"max_speed": 0.5, "min_speed": -0.3, "max_turn_rate": 0.7, "max_acceleration": 0.4}


def test_candidates_and_commands_keep_the_limits_and_reverse():
    overrides = {**STILL, **{f"robot.{key}": value for key, value in LIMITS.items()}}
    seen = []
    result = mjnav.run(mjnav.load_scenario("crossing1", overrides), watch=seen.append)
    first = seen[0].decision.costs
    assert first.v.min() == pytest.approx(-0.04)  # 0.4 m/s² for a period of 0.1 s, from rest
    assert abs(first.omega).max() == pytest.approx(0.3)
    assert result.trajectory.command[:, 0].max() <= 0.5 + 1e-12
    assert abs(result.trajectory.command[:, 1]).max() <= 0.7 + 1e-12
    assert result.trajectory.clipped_ticks == 0


KINEMATIC = ("physics.engine=kinematic",)


@pytest.fixture(scope="module")
def short():
    """It reaches its goal within two seconds."""
    return load_scenario("crossing1", (*KINEMATIC, "robot.goal=[0.9, 0.0]", "control.rate=5"))


@pytest.fixture(scope="module")
def whole(short):
    """All ticks of `short`, and when it ended."""
    records = []
    result = Episode(short, watch=records.append).run()
    assert result.summary["outcome"] == "goal"
    return records, result.summary["time_s"]


@pytest.mark.parametrize(
    ("time", "tick"), [(0.0, 0), (0.1999, 0), (0.2, 1), (0.6, 3), (0.6000001, 3), (0.79, 3), (1.0, 5)]
)
def test_it_is_the_tick_then_or_the_last_before(short, whole, time, tick):
    record, expected = record_at(short, time), whole[0][tick]
    assert record.tick == tick
    assert record.truth.time == pytest.approx(0.2 * tick)
    assert (record.observation.robot_pose == expected.observation.robot_pose).all()
    assert (record.decision.v, record.decision.omega) == (expected.decision.v, expected.decision.omega)


def test_after_the_end_of_a_run_there_is_none(short, whole):
    _, end = whole
    with pytest.raises(InvalidValue, match=rf"time: found .*; allowed: 0 to {end:g} s: there the run ended \(goal\)"):
        record_at(short, end + 0.05)

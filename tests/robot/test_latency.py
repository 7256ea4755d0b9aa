"""When decisions take effect, and what was and will be commanded, by time."""

from pathlib import Path

import numpy as np
import pytest

from mjnav import scene
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.robot.latency import CommandHistory, make_latency

MEASURED = 'control.latency={model="measured"}'


def sampled(*trace: float, **more: object) -> str:
    keys = "".join(f", {key}={value!r}" for key, value in more.items())
    return f'control.latency={{model="sampled", trace={list(trace)}{keys}}}'


def effects(scenario, num: int = 6) -> list[float]:
    """Moment of effect of each tick's decision behind the tick [s]; as if computing took no time."""
    model = make_latency(scenario, scenario.seed)
    return [model.actual(tick, 0.0) - tick * scenario.control.period for tick in range(num)]


def state_hash(scenario) -> str:
    return Episode(scenario).run().summary["state_hash"]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_whole_periods_are_expected_and_happen(empty, delay):
    scenario = empty(f"control.delay={delay}")
    model = make_latency(scenario, 0)
    assert effects(scenario) == pytest.approx([0.1 * delay] * 6)
    assert model.expected(4) == model.actual(4, 0.08)


def test_a_recorded_trace_comes_in_its_order_again_and_again(empty):
    found = effects(empty(sampled(0.01, 0.02, 0.25, 0.04, order="recorded")))
    assert found == pytest.approx([0.01, 0.02, 0.25, 0.04, 0.01, 0.02])


def test_a_drawn_trace_follows_the_seed_and_all_of_its_values_come(empty):
    trace = (0.01, 0.02, 0.04)
    first, again, other = (effects(empty(sampled(*trace), seed=seed), 60) for seed in (1, 1, 2))
    assert first == again != other
    assert {round(value, 6) for value in first} == set(trace)


def test_the_prediction_counts_on_the_median_of_the_trace_unless_it_is_told(empty):
    assert make_latency(empty(sampled(0.01, 0.05, 0.02)), 0).expected(2) == pytest.approx(0.22)
    assert make_latency(empty(sampled(0.01, planned=0.07)), 0).expected(2) == pytest.approx(0.27)
    assert make_latency(empty(MEASURED), 0).expected(2) == pytest.approx(0.25)


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_a_command_takes_force_within_the_period(empty, engine):
    """At full throttle from rest, what was driven after the first period says when the command came."""
    driven = {}
    for latency in (0.0, 0.03, 0.06):
        records = []
        scenario = empty(sampled(latency), f"physics.engine={engine}", "noise.profile=none", "time_limit=0.3")
        Episode(scenario, watch=records.append).run()
        driven[latency] = records[1].truth.robot_pose[0]
    assert driven[0.0] > driven[0.03] > driven[0.06] > 0.0
    if engine == "kinematic":
        for latency, distance in driven.items():
            assert distance == pytest.approx(0.5 * (0.1 - latency) ** 2, abs=2e-4)


def test_latency_beyond_the_period_delays_and_never_reorders(room):
    scenario = room(sampled(0.23, 0.01, order="recorded"))
    records = []
    Episode(scenario, watch=records.append).run()
    decided = [np.array([r.decision.v, r.decision.omega]) for r in records]
    # Decision 0 takes force at 0.23; 1, computed at 0.11, waits for it and takes its place; 2 comes at 0.43, with 3.
    assert np.array_equal(records[2].command, np.zeros(2))
    assert np.array_equal(records[3].command, decided[1])
    assert np.array_equal(records[4].command, decided[1])
    assert np.array_equal(records[5].command, decided[3])


def test_a_trace_may_stand_in_a_file_beside_the_run_file_or_in_the_working_folder(tmp_path, monkeypatch):
    text = 'schema = 1\nname = "a"\n[robot]\nstart = [0.0, 0.0, 0.0]\ngoal = [1.0, 0.0]\n[control]\nlatency = {}\n'
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "trace.txt").write_text("# seconds\n0.01, 0.02\n\n0.03 # slow\n")
    run_file = tmp_path / "sub" / "a.toml"
    run_file.write_text(text.replace("{}", '{ trace = "trace.txt" }'))
    found = scene.load(run_file)
    assert found.control.latency.trace == (0.01, 0.02, 0.03)
    assert scene.loads(scene.dumps(found)).control == found.control
    monkeypatch.chdir(tmp_path)
    other = scene.loads(text, ['control.latency.trace="sub/trace.txt"'], folder=tmp_path)
    assert other.control.latency.trace == (0.01, 0.02, 0.03)


@pytest.mark.parametrize(
    ("latency", "message"),
    [
        ("{}", "control.latency.trace: found nothing; allowed: compute times [s], or the path of a text file"),
        ('{trace="none.txt"}', "control.latency.trace: found 'none.txt'; allowed: a text file of numbers that can be"),
        ('{trace="bad.txt"}', "found 'fast'; allowed: numbers, one or more a line (line 2 of "),
        ("{trace=[0.1, -0.1]}", "control.latency.trace.1: found -0.1; allowed: a number from 0 to 1000 s"),
        ('{model="measured", trace=[0.1]}', "control.latency.trace: found"),
    ],
)
def test_a_latency_that_makes_no_sense_is_refused(empty, tmp_path, monkeypatch, latency, message):
    (tmp_path / "bad.txt").write_text("0.1\nfast\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidValue) as raised:
        empty(f"control.latency={latency}", folder=Path())
    assert message in str(raised.value)


DELAYS = (0, 1, 3)


@pytest.mark.parametrize("delay", DELAYS)
def test_the_stretches_reach_from_the_belief_to_the_moment_of_effect_without_a_gap(limits, delay):
    history = CommandHistory(limits)
    for tick in range(12):
        effect = (tick + delay) * 0.1
        for lag in (0.0, 0.04, 0.1, 0.13):  # the reading may be older than the tick
            start = max(0.0, tick * 0.1 - lag)
            stretches = history.stretches(start, effect)
            if effect - start < 1e-9:
                assert stretches == []
                continue
            assert stretches[0].start == pytest.approx(start)
            assert stretches[-1].end == pytest.approx(effect)
            assert [a.end for a in stretches[:-1]] == pytest.approx([b.start for b in stretches[1:]])
        history.append(effect, np.array([0.05 * tick, 0.0]))


def test_commands_switch_within_a_period_in_order_and_none_overtakes_another(limits):
    history = CommandHistory(limits)
    first, second, third = np.array([0.1, 0.0]), np.array([0.2, 0.0]), np.array([0.3, 0.0])
    history.append(0.13, first)
    history.append(0.27, second)
    history.append(0.22, third)  # computed sooner, but it waits for its turn
    assert np.array_equal(history.in_force(0.1), [0.0, 0.0])
    assert [(pytest.approx(0.03), 0.1)] == [(at, c[0]) for at, c in history.switches(0.1, 0.2)]
    assert [(at, c[0]) for at, c in history.switches(0.2, 0.3)] == [
        (pytest.approx(0.07), 0.2),
        (pytest.approx(0.07), 0.3),
    ]
    assert history.switches(0.3, 0.4) == []
    assert np.array_equal(history.in_force(0.3), third)
    assert [s.command[0] for s in history.stretches(0.1, 0.3)] == [0.0, 0.1, 0.3]

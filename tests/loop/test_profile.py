"""`--profile`: figures that add up, and a program that is as it was."""

from functools import cached_property
from importlib import import_module
from itertools import count

import pytest

import mjnav
from mjnav.loop.episode import Episode, warm_up
from mjnav.loop.pacer import FreePacer, Stopwatch
from mjnav.loop.profile import BETWEEN, OWN, TARGETS, Profile, describe, profiled
from mjnav.messages import PHASES
from mjnav.world.sensors import Sensors

NAMES = (*TARGETS, "mjnav.loop.pacer:Stopwatch.start", "mjnav.loop.pacer:Stopwatch.lap")


def present(target: str):
    module, _, path = target.partition(":")
    *owners, name = path.split(".")
    owner = import_module(module)
    for inner in owners:
        owner = getattr(owner, inner)
    return vars(owner)[name]


def test_every_target_exists_and_can_be_called():
    for target in TARGETS:
        found = present(target)
        function = found.func if isinstance(found, cached_property) else getattr(found, "__func__", found)
        assert callable(function), target


def test_a_profiled_run_ends_in_the_same_state_and_adds_only_its_figures(room):
    plain = mjnav.run(room()).summary
    summary = mjnav.run(room(), profile=True).summary
    assert summary["state_hash"] == plain["state_hash"]
    assert set(summary) == {*plain, "profile"}


def test_everything_is_restored_after_a_run_and_after_an_exception(room):
    before = [present(name) for name in NAMES]
    with profiled():
        assert present("mjnav.loop.pacer:Stopwatch.lap") is not before[-1]
        assert (
            present("mjnav.world.sensors:Sensors.read") is not before[NAMES.index("mjnav.world.sensors:Sensors.read")]
        )
        Episode(room("time_limit=0.2")).run()
    assert all(present(name) is was for name, was in zip(NAMES, before, strict=True))
    with pytest.raises(ZeroDivisionError), profiled():
        raise ZeroDivisionError
    assert all(present(name) is was for name, was in zip(NAMES, before, strict=True))


def test_parts_add_up_to_their_phase_and_phases_to_the_tick(room, tmp_path):
    scenario = room()
    warm_up(scenario)
    with profiled() as profile:
        result = Episode(scenario, log=tmp_path / "run.mcap").run()
    figures = profile.summary()
    assert figures["ticks"] == result.summary["ticks"]
    assert list(figures["phases"]) == [*PHASES, BETWEEN]
    for phase in figures["phases"].values():
        assert sum(part["mean"] for part in phase["parts"].values()) == pytest.approx(phase["mean"])
        assert sum(part["share"] for part in phase["parts"].values()) == pytest.approx(phase["share"])
    assert sum(phase["mean"] for phase in figures["phases"].values()) == pytest.approx(figures["tick_us"]["mean"])
    assert sum(phase["share"] for phase in figures["phases"].values()) == pytest.approx(1.0)


def test_phases_are_those_of_the_loops_stopwatch(room, tmp_path):
    scenario = room()
    warm_up(scenario)
    readings = count()

    def clock() -> int:
        return 1000 * next(readings)

    with profiled(clock) as profile:
        result = Episode(scenario, log=tmp_path / "run.mcap", pacer=FreePacer(clock)).run()
    phases = profile.summary()["phases"]
    seen = 1e-3 * result.trajectory.timing[:, 1 : 1 + len(PHASES)].mean(axis=0)
    assert [phases[phase]["mean"] for phase in PHASES] == pytest.approx(seen.tolist())


def test_parts_are_found_in_the_phase_that_calls_them(room, tmp_path):
    scenario = room()
    warm_up(scenario)
    with profiled() as profile:
        Episode(scenario, log=tmp_path / "run.mcap").run()
    phases = {name: set(phase["parts"]) for name, phase in profile.summary()["phases"].items()}
    assert {"physics", "lidar", "sensors", "pedestrians"} <= phases["advance"]
    assert {"robot", "people"} <= phases["estimate"]
    assert {"observe", "goal cost", "constraints on samples", "choose"} <= phases["control"]
    assert {"encode documents", "encode candidates", "write"} <= phases["record"]
    assert phases["sense"] == {"truth", OWN}


def test_a_parts_time_is_its_own(room):
    ticks = count()
    profile = Profile(lambda: 1000 * next(ticks))  # every reading of the clock is 1 us after the one before
    inner = profile.timed(lambda: None, "inner")
    outer = profile.timed(lambda: (inner(), inner()), "outer")
    watch = Stopwatch(lambda: 0)
    start, lap = profile.starting(Stopwatch.start), profile.lapping(Stopwatch.lap)
    start(watch)
    outer()
    for _ in PHASES:
        lap(watch)
    start(watch)
    figures = profile.summary()
    first = figures["phases"]["sense"]["parts"]
    # Six readings: outer began, inner 1 -> 2, inner 3 -> 4, outer ended at 6, the lap at 7.
    assert {part: (row["mean"], row["calls"]) for part, row in first.items()} == {
        "outer": (3.0, 1.0),
        "inner": (2.0, 2.0),
        OWN: (2.0, 0.0),
    }
    assert figures["ticks"] == 1


def test_a_part_that_raises_is_counted_and_the_error_passes():
    profile = Profile(count().__next__)

    def broken():
        raise KeyError("x")

    with pytest.raises(KeyError):
        profile.timed(broken, "broken")()
    assert profile._tick["sense", "broken"] == [1, 1]


def test_a_run_without_a_tick_has_a_profile_without_figures(room):
    with profiled() as profile:
        Episode(room(), stop=lambda: True).run()
    assert profile.summary() == {"ticks": 0, "tick_us": None, "phases": {}}
    assert describe(profile.summary()).split() == ["us", "a", "tick", "p50", "p99", "mean", "share", "calls"]


def test_the_log_is_the_same_with_a_profile(room, tmp_path):
    plain = mjnav.run(room(), log=tmp_path / "plain.mcap")
    with_profile = mjnav.run(room(), log=tmp_path / "profiled.mcap", profile=True)
    topics = [mjnav.open_log(result.summary["log"]).topics for result in (plain, with_profile)]
    assert topics[0].keys() == topics[1].keys()
    assert [t.messages for t in topics[0].values()] == [t.messages for t in topics[1].values()]


def test_the_table_has_a_row_for_every_part(room):
    figures = mjnav.run(room("time_limit=0.2"), profile=True).summary["profile"]
    lines = describe(figures).splitlines()
    parts = [part for phase in figures["phases"].values() for part in phase["parts"]]
    assert len(lines) == 1 + len(figures["phases"]) + len(parts) + 1
    assert any(line.startswith("  physics") for line in lines)
    assert vars(Sensors)["read"].__qualname__ == "Sensors.read"

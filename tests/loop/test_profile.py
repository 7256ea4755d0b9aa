"""`--profile`: figures that add up, of a run that ends as it would without."""

import pytest

from mjnav.loop.episode import Episode
from mjnav.loop.pacer import BETWEEN, SPANS
from mjnav.messages import PHASES


def test_a_profiled_run_ends_in_the_same_state_and_adds_only_its_figures(room):
    plain = Episode(room()).run().summary
    summary = Episode(room(), profile=True).run().summary
    assert summary["state_hash"] == plain["state_hash"]
    assert set(summary) == {*plain, "profile"}


def test_parts_add_up_to_their_phase_and_phases_to_the_tick(room, tmp_path):
    result = Episode(room(), log=tmp_path / "run.mcap", profile=True).run()
    figures = result.summary["profile"]
    assert figures["ticks"] == result.summary["ticks"]
    assert list(figures["phases"]) == [*PHASES, BETWEEN]
    assert {part for phase in figures["phases"].values() for part in phase["parts"]} <= set(SPANS)
    for name in ("sense", "control", "record"):
        phase = figures["phases"][name]
        assert sum(part["mean"] for part in phase["parts"].values()) == pytest.approx(phase["mean"])
        assert sum(part["share"] for part in phase["parts"].values()) == pytest.approx(phase["share"])
    assert sum(phase["mean"] for phase in figures["phases"].values()) == pytest.approx(figures["tick_us"]["mean"])
    assert sum(phase["share"] for phase in figures["phases"].values()) == pytest.approx(1.0)

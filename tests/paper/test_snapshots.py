"""What matching does to the closest person's samples, and the figure of that."""

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest

from mjnav.loop.prepare import load_scenario
from mjnav.paper import snapshots
from mjnav.paper.claims import Verdict, judge
from mjnav.paper.episodes import DIRECT
from mjnav.paper.snapshots import GOAL, MATCHED, draw_snapshots, snapshot_claims


def measure(scenario):
    return snapshots.measure_snapshots([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    short = ("physics.engine=kinematic", "time_limit=4.0", "control.degree=3")
    return load_scenario("five", [*DIRECT, *short], controller="rkhs")


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


def test_the_matched_control_is_the_run_s_choice_and_leaves_most_samples_safe(data):
    assert len(data.hardest()) >= 2
    for snapshot in data.decisions:
        decision = snapshot.record.decision
        assert snapshot.controls[MATCHED].tolist() == [decision.v, decision.omega]
        assert snapshot.matters == (snapshot.controls[GOAL].tolist() != snapshot.controls[MATCHED].tolist())


def as_many_runs(data, shares):
    """Decisions of eight runs, of whose 100 samples these shares are safe under each control."""
    f = tuple(np.where(np.arange(100) < 100 * share, -1.0, 1.0) for share in shares)
    decisions = tuple(replace(s, run=i % 8, f=f, matters=True) for i, s in enumerate(data.decisions))
    return replace(data, outcomes=("goal",) * 8, decisions=decisions)


@pytest.mark.parametrize(
    ("shares", "safe", "pushed"),
    [
        ((0.2, 0.5, 1.0), Verdict.HOLDS, Verdict.HOLDS),
        ((0.2, 0.9, 0.5), Verdict.FAILS, Verdict.MIXED),
        ((0.9, 0.9, 0.5), Verdict.FAILS, Verdict.FAILS),
    ],
)
def test_shares_decide_the_claims(data, shares, safe, pushed):
    found = judge(snapshot_claims(as_many_runs(data, shares)))
    assert [finding.verdict for finding in found] == [safe, pushed]
    assert f"{100 * (shares[MATCHED] - shares[GOAL]):+.3g} points" in found[1].evidence
    assert "0 of the runs ended in a collision" in found[0].evidence


def test_two_runs_decide_nothing(data):
    assert [finding.verdict for finding in judge(snapshot_claims(data))] == [Verdict.OPEN] * 2
    unmoved = tuple(replace(snapshot, matters=False) for snapshot in data.decisions)
    assert judge(snapshot_claims(replace(data, decisions=unmoved))) == ()


def test_every_snapshot_has_a_column_all_samples_in_its_histograms_and_leaves_no_style(data):
    before, drawn = dict(mpl.rcParams), data.hardest()
    figure = draw_snapshots(data)
    assert dict(mpl.rcParams) == before
    assert [axes.get_title(loc="left") for axes in figure.axes[: len(drawn)]] == [f"{s.time:.1f} s" for s in drawn]
    for axes in figure.axes[len(drawn) :]:
        histograms = [patch.get_data().values for patch in axes.patches if hasattr(patch, "get_data")]
        assert [values.sum() for values in histograms] == pytest.approx([1.0] * 3)

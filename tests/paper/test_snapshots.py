"""What matching does to the closest person's samples, and the figure of that."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.constraints import collision_cone
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.paper import safe_shares
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.item import Verdict, judge
from mjnav.paper.safe_shares import GOAL, MATCHED, NOMINAL
from mjnav.paper.snapshots import claims, picture

SHORT = ("physics.engine=kinematic", "time_limit=4.0", "control.degree=3")


def measure(scenario):
    return safe_shares.measure([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("five", [*options(DIRECT), *SHORT], controller="rkhs")


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


@pytest.fixture(scope="module")
def records(scenario):
    found = {}
    Episode(scenario, watch=lambda record: found.update({record.truth.time: record}), cones=True).run()
    return found


def test_the_matched_samples_are_those_that_the_run_logs_for_its_choice(data, records):
    assert data.snapshots
    for snapshot in data.snapshots:
        record = records[snapshot.time]
        assert record.cone.obstacle == f"person{snapshot.closest}"
        assert np.array_equal(snapshot.f[MATCHED], record.cone.samples)
        assert np.array_equal(snapshot.desired, record.cone.desired)
        assert snapshot.controls[MATCHED].tolist() == [record.decision.v, record.decision.omega]
        assert np.array_equal(snapshot.pose, record.truth.robot_pose)
        assert snapshot.trail[-1].tolist() == record.truth.robot_pose[:2].tolist()
        assert len(snapshot.trail) == record.tick + 1


def test_samples_of_all_controls_are_the_cone_s_pair_by_pair(scenario, data):
    for snapshot in data.snapshots[:2]:
        person = snapshot.people_samples[snapshot.closest]
        noise = None
        for (v, omega), f in zip(snapshot.controls, snapshot.f, strict=True):
            assert f.size == len(snapshot.samples) * len(person.position)
            assert f.max() <= 1.0
            assert f.min() >= -data.clip
            noise = f if noise is None else noise
            # Without actuation noise, about as many pairs collide.
            heading = snapshot.samples[:, 2] + 0.4 * omega
            velocity = v * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
            r = snapshot.samples[:, None, :2] - person.position
            q = velocity[:, None] - person.velocity
            still = collision_cone(r, q, scenario.robot.radius + person.radius + 0.05, horizon=5.0)
            assert (still <= 0.0).mean() == pytest.approx((f <= 0.0).mean(), abs=0.15)


def test_drawn_are_the_hardest_decisions_that_matter_apart_and_in_order(data):
    times = [snapshot.time for snapshot in data.snapshots]
    assert 2 <= len(times) <= safe_shares.NUM_SNAPSHOTS
    assert (np.diff(times) >= safe_shares.GAP - 1e-9).all()
    drawn = np.isin(data.time, times) & (data.run == 0)
    assert data.matters[drawn].all()
    assert times[0] >= safe_shares.SETTLED
    rivals = data.matters & (data.run == 0) & (data.time >= safe_shares.SETTLED)
    assert data.share[drawn, GOAL].min() == data.share[rivals, GOAL].min()


def as_many_runs(data, share):
    run = np.arange(len(data.run)) % 8
    return replace(data, run=run, share=share, outcome=("goal",) * 8, matters=np.ones(len(run), bool))


@pytest.mark.parametrize(
    ("goal", "nominal", "matched", "safe", "pushed"),
    [
        (0.2, 0.5, 1.0, Verdict.HOLDS, Verdict.HOLDS),
        (0.2, 0.9, 0.5, Verdict.FAILS, Verdict.MIXED),
        (0.9, 0.9, 0.5, Verdict.FAILS, Verdict.FAILS),
    ],
)
def test_shares_decide_the_claims(data, goal, nominal, matched, safe, pushed):
    share = np.empty((len(data.run), 3))
    share[:, GOAL], share[:, NOMINAL], share[:, MATCHED] = goal, nominal, matched
    found = judge(claims(as_many_runs(data, share)))
    assert [finding.verdict for finding in found] == [safe, pushed]
    assert f"{100 * (matched - goal):+.3g} points" in found[1].evidence
    assert "0 [0.0, 2.6] ended in a collision" in found[0].evidence


def test_two_runs_decide_nothing(data):
    found = judge(claims(data))
    assert [finding.verdict for finding in found] == [Verdict.OPEN] * 2
    assert judge(claims(replace(data, matters=np.zeros(len(data.run), bool)))) == ()


def test_a_method_that_matches_nothing_and_an_empty_room_are_refused(scenario):
    saa = replace(scenario, control=replace(scenario.control, method="saa", parameters={}))
    with pytest.raises(InvalidValue, match="method"):
        measure(saa)
    with pytest.raises(InvalidValue, match="people"):
        measure(replace(scenario, people=(), time_limit=0.3))


def titles(figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes if axes.get_title(loc="left")]


def test_every_snapshot_has_a_column_and_all_samples_in_its_histograms(data):
    s = data.snapshots
    figure = picture(data)
    assert titles(figure) == [f"{snapshot.time:.1f} s" for snapshot in s]
    for snapshot, axes in zip(s, figure.axes[len(s) : 2 * len(s)], strict=True):
        matched, goal, desired = (patch for patch in axes.patches if hasattr(patch, "get_data"))
        for stairs in (matched, goal, desired):
            assert stairs.get_data().values.sum() == pytest.approx(1.0)
        values, edges, _ = matched.get_data()
        assert np.isclose(edges, 0.0).any()
        assert values[edges[:-1] >= -1e-9].sum() == pytest.approx((snapshot.f[MATCHED] > 0.0).mean())
        assert not desired.get_data().values[edges[:-1] >= -1e-9].any()
    for snapshot, axes in zip(s, figure.axes[2 * len(s) : 3 * len(s)], strict=True):
        shares = [bar.get_width() for bar in axes.patches[1::2]]
        assert shares[0] == pytest.approx((snapshot.f[MATCHED] <= 0.0).mean())
        assert shares[2] == pytest.approx((snapshot.f[GOAL] <= 0.0).mean())

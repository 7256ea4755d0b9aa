"""What matching does to the closest person's samples, and the moments that are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.constraints import collision_cone
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.paper import DIRECT, snapshots
from mjnav.paper.by_run import LEAST_RUNS, mean_by_run
from mjnav.paper.finding import Verdict
from mjnav.paper.snapshots import GOAL, MATCHED, NOMINAL

SHORT = ("physics.engine=kinematic", "time_limit=4.0", "control.degree=3")


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("five", [*DIRECT, *SHORT], controller="rkhs")


@pytest.fixture(scope="module")
def data(scenario):
    return snapshots.measure([scenario], quick=True)


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
    assert 2 <= len(times) <= snapshots.NUM_SNAPSHOTS
    assert (np.diff(times) >= snapshots.GAP - 1e-9).all()
    drawn = np.isin(data.time, times) & (data.run == 0)
    assert data.matters[drawn].all()
    assert times[0] >= snapshots.SETTLED
    rivals = data.matters & (data.run == 0) & (data.time >= snapshots.SETTLED)
    assert data.share[drawn, GOAL].min() == data.share[rivals, GOAL].min()


def test_shares_are_those_of_the_drawn_samples_and_rows_repeat_them(data):
    rows = data.rows()
    assert len(rows) == len(data.time) == len(data.share)
    for snapshot in data.snapshots:
        i = int(np.flatnonzero((data.time == snapshot.time) & (data.run == 0))[0])
        assert data.share[i] == pytest.approx([(f <= 0.0).mean() for f in snapshot.f])
        assert rows[i]["safe_goal_alone"] == data.share[i, GOAL]
        assert rows[i]["safe_matched"] == data.share[i, MATCHED]
        assert rows[i]["closest"] == f"person{snapshot.closest}"
    unmoved = ~data.matters
    assert np.array_equal(data.share[unmoved, GOAL], data.share[unmoved, MATCHED])


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
    found = snapshots.findings(as_many_runs(data, share))
    assert [finding.verdict for finding in found] == [safe, pushed]
    assert f"{100 * (matched - goal):+.3g} points" in found[1].evidence
    assert "0 [0.0, 2.6] ended in a collision" in found[0].evidence


def test_two_runs_decide_nothing(data):
    found = snapshots.findings(data)
    assert [finding.verdict for finding in found] == [Verdict.OPEN] * 2
    assert snapshots.findings(replace(data, matters=np.zeros(len(data.run), bool))) == ()


def test_a_mean_by_run_counts_runs_not_decisions():
    run = np.repeat(np.arange(6), [100, 1, 1, 1, 1, 1])
    values = np.where(run == 0, 1.0, 0.0)
    found = mean_by_run(run, values, 0, "test")
    assert (found.estimate.value, found.estimate.num) == (pytest.approx(1.0 / 6.0), 6)
    assert found.estimate.interval[0] == 0.0  # the first run may not be drawn
    assert found.estimate.interval[1] == pytest.approx(0.5)
    assert found == mean_by_run(run, values, 0, "test")
    few = run < LEAST_RUNS - 1
    too_few = mean_by_run(run[few], values[few], 0, "test")
    assert (too_few.estimate.interval, too_few.p) == (None, None)


def test_a_method_that_matches_nothing_and_an_empty_room_are_refused(scenario):
    saa = replace(scenario, control=replace(scenario.control, method="saa", parameters={}))
    with pytest.raises(InvalidValue, match="method"):
        snapshots.measure([saa], quick=True)
    with pytest.raises(InvalidValue, match="people"):
        snapshots.measure([replace(scenario, people=(), time_limit=0.3)], quick=True)

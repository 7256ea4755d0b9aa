"""The table [faults] of a run file."""

from pathlib import Path

import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.scene.faults import Dropout, Faults, Kidnapping
from mjnav.scene.load import dumps, load, loads
from mjnav.study.cells import resolve
from mjnav.study.study_file import load_study


def test_a_scene_without_faults_does_not_mention_them():
    assert "faults" not in dumps(load("hall"))


@pytest.mark.parametrize("kidnap", [{"time": 3, "pose": [2, 1, 0]}, [{"time": 1, "pose": [2, 1, 0]}]])
def test_faults_go_to_a_file_and_back(kidnap):
    given = {"faults.kidnap": kidnap, "faults.lidar.blocked.angles": [-1, 1], "faults.wheels.slip": {"to": 4}}
    scenario = load("hall", given)
    assert scenario.faults is not None
    assert loads(dumps(scenario)) == scenario
    assert [(channel, kind, fault.end) for channel, kind, fault in scenario.faults.each()] == [
        ("lidar", "blocked", float("inf")),
        ("wheels", "slip", 4.0),
    ]


def test_a_fault_lasts_from_its_first_moment_to_before_its_last():
    fault = Dropout(start=1.0, end=2.0)
    assert [fault.lasts(time) for time in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("faults.lidar.dropuot.share=1", "faults.lidar.dropuot: found 'dropuot'.*did you mean 'dropout'"),
        ("faults.lidr={}", "did you mean 'lidar'"),
        ("faults.gyro.dropout.share=1.5", "faults.gyro.dropout.share: found 1.5; allowed: a number from 0 to 1"),
        ("faults.gyro.stuck={from=3,to=2}", "faults.gyro.stuck.to: found 2.0; allowed: a time after `from`"),
        ("faults.pose.outliers.size=-1", "faults.pose.outliers.size: found -1.0; allowed: a number from 0 to 10000"),
        ("faults.pose.blocked={}", "faults.pose.blocked: found 'blocked'"),
        ("faults.kidnap={time=1,pose=[6,0.3,0]}", "faults.kidnap.pose: .*clear of pillars.0"),
        ("faults.kidnap=[{time=1,pose=[4.2,-1.6,0]}]", "faults.kidnap.0.pose: .*clear of tables.0"),
        ("faults.kidnap=[{time=2,pose=[1,0,0]},{time=1,pose=[1,0,0]}]", "faults.kidnap: .*times that increase"),
    ],
)
def test_a_bad_value_is_refused_with_its_key(override, message):
    with pytest.raises(InvalidValue, match=message):
        load("hall", [override])


def test_a_study_sweeps_over_single_faults_and_over_a_share(tmp_path: Path):
    text = """
        schema = 1
        name = "faults"
        scenes = ["crossing1"]
        seeds = { first = 0, count = 1 }
        methods = [{ controller = "mean" }]
        [[settings]]
        name = "none"
        [[settings]]
        name = "no lidar"
        set.faults.lidar.dropout.from = 2.0
        [[settings]]
        name = "stuck"
        set.faults.gyro.stuck = {}
        [grid]
        faults.pose.dropout.share = [0.1, 0.5]
    """
    path = tmp_path / "faults.toml"
    path.write_text(text)
    scenes = [loads(cell.document) for cell in resolve(load_study(path))]
    found = [tuple(f"{c}.{k}" for c, k, _ in s.faults.each()) for s in scenes if s.faults is not None]
    assert sorted(found) == sorted(
        [("pose.dropout",), ("lidar.dropout", "pose.dropout"), ("gyro.stuck", "pose.dropout")] * 2
    )


def test_faults_may_be_given_as_objects():
    faults = Faults(Kidnapping(1.0, (2.0, 1.0, 0.0)))
    assert mjnav.load_scenario("hall", {"faults": faults}).faults == faults

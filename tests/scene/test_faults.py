"""The table [faults] of a run file."""

import pytest

from mjnav.errors import InvalidValue
from mjnav.scene.load import dumps, load, loads


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


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("faults.lidar.dropuot.share=1", "faults.lidar.dropuot: found 'dropuot'.*did you mean 'dropout'"),
        ("faults.gyro.dropout.share=1.5", "faults.gyro.dropout.share: found 1.5; allowed: a number from 0 to 1"),
        ("faults.gyro.stuck={from=3,to=2}", "faults.gyro.stuck.to: found 2.0; allowed: a time after `from`"),
        ("faults.kidnap={time=1,pose=[6,0.3,0]}", "faults.kidnap.pose: .*clear of pillars.0"),
        ("faults.kidnap=[{time=2,pose=[1,0,0]},{time=1,pose=[1,0,0]}]", "faults.kidnap: .*times that increase"),
    ],
)
def test_a_bad_value_is_refused_with_its_key(override, message):
    with pytest.raises(InvalidValue, match=message):
        load("hall", [override])

"""A plan in a log: read back, drawn, in tables, and in nobody else's log."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.log import Recorder, open_log
from mjnav.log.encode.plan import FAN_POINTS, decode_plan, encode_plan, plan_schema
from mjnav.log.export.rosbag2 import segments
from mjnav.sealed import sealed_plan
from tests.log.conftest import message_class

ARRAYS = ("path", "fan", "fan_cost", "violation")


def assert_same(found, plan):
    assert (found.step, found.feasible) == (plan.step, plan.feasible)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(plan, name).astype("f4"))


@pytest.mark.parametrize("sizes", [(32, 20, 48), (0, 3, 200)])
def test_a_plan_reads_back_through_its_own_schema(made_up, sizes):
    plan = made_up.plan(*sizes)
    assert_same(decode_plan(message_class(plan_schema()).FromString(encode_plan(plan))), plan)


def test_paths_that_differ_in_length_are_refused(made_up):
    data = encode_plan(made_up.plan())
    with pytest.raises(ValueError, match="a path of 40 numbers, 33 rollouts of 1280 in all"):
        decode_plan(message_class(plan_schema()).FromString(data + b"\x22\x04\x00\x00\x80\x3f"))
    plan = made_up.plan()
    with pytest.raises(ValueError, match=r"shapes \(20, 2\), \(31, 20, 2\), \(32,\), \(48,\)"):
        sealed_plan(replace(plan, fan=plan.fan[1:]))


def written(path, scenario, records):
    with Recorder(path, scenario, {"scene": "made-up"}, "<mujoco/>") as recorder:
        for record in records:
            recorder.write(record)
    return open_log(path)


def test_a_log_has_plans_of_the_ticks_that_have_one(tmp_path, scenario, made_up):
    records = [made_up.planned(tick) if tick in (2, 3, 5) else made_up.record(tick) for tick in range(6)]
    log = written(tmp_path / "a.mcap", scenario, records)
    found = {message.sequence: message for message in log.messages("/plan")}
    assert [*found] == [2, 3, 5]
    for tick, message in found.items():
        assert message.time_ns == tick * 100_000_000
        assert_same(decode_plan(message.value), records[tick].decision.plan)


def test_the_scene_draws_the_plan_whole_and_its_fan_by_the_order_of_cost(tmp_path, scenario, made_up):
    record = made_up.planned(0)
    plan = record.decision.plan
    (message,) = written(tmp_path / "a.mcap", scenario, [record]).messages("/scene")
    (entity,) = [entity for entity in message.value.entities if entity.id == "plan"]
    *fan, followed = entity.lines
    assert [len(line.points) for line in fan] == [4 * FAN_POINTS] * 8
    corners = np.array([[point.x, point.y] for line in fan for point in line.points]).reshape(32, FAN_POINTS, 2)
    np.testing.assert_allclose(corners, plan.fan[:, [0, 4, 9, 14, 19]], atol=2**-11)
    assert fan[0].color.g > fan[-1].color.g  # from green to red
    drawn = [ends for line in entity.lines for ends in segments(line)]
    assert len(drawn) == 32 * (FAN_POINTS - 1) + 19
    ends = np.array([[point.x, point.y] for point in (*(start for start, _ in drawn[-19:]), drawn[-1][1])])
    np.testing.assert_allclose(ends, plan.path, atol=2**-11)
    assert (followed.color.b > followed.color.r) == plan.feasible
    (stand,) = entity.cylinders
    assert [stand.pose.position.x, stand.pose.position.y] == pytest.approx(plan.path[-1])
    assert stand.size.x == 2 * scenario.robot.radius
    assert entity.lifetime.ToNanoseconds() == 200_000_000

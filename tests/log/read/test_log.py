import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import MCAP0_MAGIC, Writer

from mjnav.errors import DamagedLogError, InputError
from mjnav.log import Recorder, open_log
from mjnav.log.read.trajectory import TrajectoryBuilder
from mjnav.messages import Status


def record_run(path, scenario, made_up, contact, num_ticks=6, finish=True):
    """Records a run to a log and to memory; gives the trajectory from memory."""
    builder = TrajectoryBuilder()
    with Recorder(path, scenario, {"seed": "3"}, "<mujoco/>") as recorder:
        for tick in range(num_ticks):
            record = made_up.record(tick)
            if tick == 2:  # every optional part is missing
                decision = replace(record.decision, costs=None, status=Status.INFEASIBLE)
                record = replace(record, decision=decision, reading=None, cone=None, tracks=record.tracks[1:4])
            if tick == 3:
                record = replace(record, truth=replace(record.truth, contacts=(contact,)))
            timing = made_up.timing(tick)
            recorder.write(record)
            recorder.write_timing(timing)
            builder.add(record)
            builder.add_timing(timing)
        final = made_up.truth(num_ticks, contacts=(contact, contact))
        if finish:
            recorder.finish(final, {"outcome": "goal", "text": "1.5", "deep": {"a": [1, None]}, "none": None, "x": 0.1})
    return builder.finish(final)


def assert_same(a, b):
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if isinstance(x, np.ndarray):
            assert (x.dtype, x.shape) == (y.dtype, y.shape), field.name
            np.testing.assert_array_equal(x, y, err_msg=field.name)
        else:
            assert x == y, field.name


@pytest.mark.parametrize("num_people", [0, 5])
def test_the_trajectory_from_a_log_is_that_from_memory_to_the_last_bit(
    tmp_path, scenario, made_up, contact, num_people
):
    scenario, made_up.num_people = replace(scenario, people=scenario.people[:num_people]), num_people
    memory = record_run(tmp_path / "a.mcap", scenario, made_up, contact)
    assert_same(open_log(tmp_path / "a.mcap").trajectory(), memory)
    assert len(memory.contacts) == 3
    assert np.isnan(memory.nominal[2]).all()
    assert memory.deadline_misses == 1
    if num_people:
        assert np.isnan(memory.tracks[2, [0, 4]]).all()
        assert np.isfinite(memory.tracks[2, 1:4]).all()


def test_a_result_keeps_its_types(tmp_path, scenario, made_up, contact):
    record_run(tmp_path / "a.mcap", scenario, made_up, contact)
    log = open_log(tmp_path / "a.mcap")
    assert log.result == {"outcome": "goal", "text": "1.5", "deep": {"a": [1, None]}, "none": None, "x": 0.1}
    assert (log.complete, log.truncated, log.run["seed"]) == (True, False, "3")
    assert log.scenario() == scenario


def test_a_topics_rate_is_over_its_own_span(tmp_path, scenario, made_up, contact):
    record_run(tmp_path / "a.mcap", scenario, made_up, contact)
    log = open_log(tmp_path / "a.mcap")
    scan, command = log.topics["/scan"], log.topics["/command"]
    assert (scan.messages, scan.max_gap_ns) == (5, 200_000_000)  # tick 2 had none
    assert scan.hz == pytest.approx(4 / 0.5)
    assert command.hz == pytest.approx(10.0)
    assert command.bytes == sum(
        len(json.dumps(message.value, separators=(",", ":"))) for message in log.messages("/command")
    )
    assert log.duration == pytest.approx(0.6)
    assert log.topics["/events"].hz is None


def test_a_run_without_an_end_gives_its_whole_ticks(tmp_path, scenario, made_up, contact):
    memory = record_run(tmp_path / "a.mcap", scenario, made_up, contact, finish=False)
    log = open_log(tmp_path / "a.mcap")
    assert (log.complete, log.truncated, log.result) == (False, False, None)
    trajectory = log.trajectory()
    assert len(trajectory.status) == 5
    np.testing.assert_array_equal(trajectory.robot_pose, memory.robot_pose[:6])
    np.testing.assert_array_equal(trajectory.timing, memory.timing[:5])


in_module_folder = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@in_module_folder
@given(share=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_any_changed_bit_of_a_whole_log_is_found(whole, share, bit):
    folder, content = whole.parent, whole.read_bytes()
    changed = bytearray(content)
    position = len(MCAP0_MAGIC) + int(share * (len(content) - len(MCAP0_MAGIC)))
    changed[position] ^= 1 << bit
    path = folder / "changed.mcap"
    path.write_bytes(changed)
    with pytest.raises(DamagedLogError) as error:
        open_log(path)
    assert error.value.exit_code == 3
    assert "\n" not in str(error.value)


@in_module_folder
@given(share=st.floats(0, 1, exclude_max=True) | st.floats(0, 0.01))
def test_a_log_cut_off_anywhere_is_read_as_far_as_it_goes(whole, share):
    folder, content = whole.parent, whole.read_bytes()
    length = int(share * len(content))
    path = folder / "cut.mcap"
    path.write_bytes(content[:length])
    metadata_end = content.index(b"mjnav/run") + len("mjnav/run") + 4 + 4 + len("seed") + 4 + len("3")
    if length < metadata_end:
        with pytest.raises(InputError if length < len(MCAP0_MAGIC) else DamagedLogError):
            open_log(path)
    else:
        log = open_log(path)
        assert log.run["seed"] == "3"
        assert log.truncated == (length < len(content) - len(MCAP0_MAGIC))
        sequence = [message.sequence for message in log.messages("/command")]
        assert sequence == list(range(len(sequence)))


def test_another_programs_log_can_be_read_but_has_no_run(tmp_path):
    path = tmp_path / "foreign.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/chatter", "text", 0)
        for i in range(3):
            writer.add_message(channel, i * 500_000_000, b"hello", 0)
        writer.finish()
    log = open_log(path)
    assert (log.run, log.result, log.complete, log.truncated) == (None, None, False, False)
    assert log.topics["/chatter"].hz == 2.0
    assert [message.value for message in log.messages()] == [b"hello"] * 3
    with pytest.raises(InputError, match="written by mjnav"):
        log.scenario()
    with pytest.raises(InputError, match="no whole tick"):
        log.trajectory()

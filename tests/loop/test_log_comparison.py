"""The differences of two documents: every single value, with its path."""

import pytest

from mjnav.loop.log_comparison import FieldDifference, differences, logged_ticks
from mjnav.recording.read.log import LogMessage


def test_equal_documents_have_no_differences():
    document = {"a": [1.0, None, {"name": "person1", "b": True}]}
    assert differences("truth", "/x a", document, {"a": [1.0, None, {"name": "person1", "b": True}]}) == []


def test_every_difference_has_its_field_and_its_amount():
    before = {"pose": [1.0, 2.0], "people": [{"name": "person7", "v": 1}], "status": "ok", "gone": 3, "flag": False}
    after = {"pose": [1.0, 2.5], "people": [{"name": "person7", "v": 4}], "status": "stopped", "flag": True}
    found = {d.field: (d.logged, d.again, d.amount) for d in differences("truth", "/x", before, after)}
    assert found == {
        "/x.pose.1": (2.0, 2.5, 0.5),
        "/x.people.person7.v": (1, 4, 3),
        "/x.status": ("ok", "stopped", None),
        "/x.gone": (3, None, None),
        "/x.flag": (False, True, None),
    }


def test_a_longer_list_differs_from_none():
    assert differences("reading", "/x", [[1.0]], [[1.0], [2.0]]) == [FieldDifference("reading", "/x.1.0", None, 2.0)]


def test_numbers_are_compared_to_the_last_bit():
    (found,) = differences("truth", "/x", 0.1 + 0.2, 0.3)
    assert found.amount == pytest.approx(5.55e-17, rel=0.01)


def test_messages_are_grouped_by_tick():
    messages = [LogMessage("/odometry", 0, tick, {"v": v}) for tick, v in ((0, 1.0), (2, 2.0), (2, 3.0))]
    assert [tuple(tick) for tick in logged_ticks(messages)] == [
        (0, {"/odometry": [{"v": 1.0}]}),
        (2, {"/odometry": [{"v": 2.0}, {"v": 3.0}]}),
    ]

"""What is told of a run that broke."""

import json
import pickle
import traceback

import numpy as np
import pytest

from mjnav.errors import MjnavError
from mjnav.loop.faults.fault import RunFault, describe_fault, fault_events
from mjnav.loop.faults.heartbeat import location


def raised(call) -> Exception:
    with pytest.raises(Exception) as caught:  # noqa: PT011
        call()
    return caught.value


def test_the_place_is_the_users_own_line_not_the_librarys_below_it():
    for call in (lambda: json.loads("{"), lambda: np.zeros((2, 2)) @ np.zeros(3)):
        where = location(traceback.extract_tb(raised(call).__traceback__))
        assert where.startswith(f"{__file__}:{call.__code__.co_firstlineno}, in ")


def test_an_exception_without_a_way_to_it_has_no_place():
    assert describe_fault(ValueError("odd")) == "ValueError: odd"
    assert describe_fault(ValueError()) == "ValueError"


def test_it_is_one_line_however_long_its_text():
    text = describe_fault(ValueError("a\n  b " + "x" * 10_000))
    assert text.startswith("ValueError: a b xxx")
    assert len(text) < 400


def test_mjnavs_own_words_stand_for_themselves():
    error = raised(lambda: (_ for _ in ()).throw(MjnavError("the disk is full")))
    assert describe_fault(error) == "the disk is full"
    assert [event.name for event in fault_events(error)] == ["fault"]
    assert [event.name for event in fault_events(raised(lambda: 1 // 0))] == ["fault", "traceback"]


def test_a_fault_survives_the_way_between_processes_with_its_result():
    fault = pickle.loads(pickle.dumps(RunFault("broke", result={"ticks": 3})))
    assert (str(fault), fault.result, fault.exit_code) == ("broke", {"ticks": 3}, 1)

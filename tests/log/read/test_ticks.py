"""Ticks put together from documents: whole ones only, and what lies between them."""

import json

import pytest

from mjnav.log.encode import json_messages
from mjnav.log.read.ticks import TICK, TIMING, TRUTH, BadDocument, TickAssembler
from mjnav.messages import Trajectory
from tests.log.conftest import MadeUpRun


def documents_of(run, tick):
    """A made-up tick's documents by topic."""
    record = run.record(tick)
    encoded = {
        "/robot/state": json_messages.encode_robot(tick, record.truth, record.belief),
        "/people/truth": json_messages.encode_people_truth(tick, record.truth),
        "/contacts": json_messages.encode_contacts(tick, record.truth),
        "/people/estimate": json_messages.encode_people_estimate(record),
        "/decision": json_messages.encode_decision(tick, record.decision),
        "/command": json_messages.encode_command(tick, record.command),
        TIMING: json_messages.encode_timing(run.timing(tick)),
    }
    return {topic: json.loads(data) for topic, data in encoded.items()}


def assembled(ticks, *, across_gaps):
    assembler = TickAssembler(across_gaps=across_gaps)
    for tick, found in ticks:
        for topic, document in found.items():
            assembler.add(topic, tick, document)
    return assembler.finish()


@pytest.fixture
def ticks():
    run = MadeUpRun(num_people=2, num_candidates=5)
    return [(tick, documents_of(run, tick)) for tick in range(10)]


def test_a_run_ends_before_the_first_tick_that_is_not_whole(ticks):
    del ticks[6][1]["/command"]
    run = assembled(ticks, across_gaps=False)
    assert run.ticks.tolist() == [0, 1, 2, 3, 4, 5, 6]  # of the sixth there is still the truth
    assert len(run.trajectory.status) == len(run.trajectory.timing) == 6


def test_across_gaps_ticks_that_are_not_whole_are_left_out(ticks):
    del ticks[0][1]["/contacts"]
    del ticks[6][1]["/command"]
    del ticks[8]
    run = assembled(ticks, across_gaps=True)
    assert run.ticks.tolist() == [1, 2, 3, 4, 5, 7, 9]
    assert run.trajectory.time.tolist() == [found["/robot/state"]["time"] for tick, found in ticks if tick in run.ticks]
    assert len(run.timing) == 9  # what is known of a tick's timing counts without the tick


@pytest.mark.parametrize("topic", TICK)
@pytest.mark.parametrize("bad", [None, 3, [], "text", {}, {"people": [{}]}, {"contacts": [{"kind": 1}]}])
def test_a_foreign_document_is_an_error_or_leaves_its_tick_out(ticks, topic, bad):
    ticks[4][1][topic] = bad
    if (run := assembled(ticks, across_gaps=True)) is not None:
        assert 4 not in run.ticks[:-1]
    with pytest.raises(BadDocument, match="tick 4 is not one of mjnav's"):
        assembled(ticks, across_gaps=False)


def test_a_tick_with_another_number_of_people_is_left_out(ticks):
    ticks[3][1]["/people/truth"]["people"].pop()
    assert assembled(ticks, across_gaps=True).ticks.tolist() == [0, 1, 2, 4, 5, 6, 7, 8, 9]
    with pytest.raises(BadDocument, match="2 people have become 1"):
        assembled(ticks, across_gaps=False)


def test_no_documents_give_no_run_and_truth_alone_gives_no_tick(ticks):
    assert assembled([], across_gaps=True) is None
    only_truth = [(0, {topic: ticks[0][1][topic] for topic in TRUTH})]
    run = assembled(only_truth, across_gaps=False)
    assert isinstance(run.trajectory, Trajectory)
    assert (len(run.trajectory.status), run.trajectory.people_ess.shape) == (0, (0, 2))
    assert run.ticks.tolist() == [0]

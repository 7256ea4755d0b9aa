"""Objects of the Python interface have reprs of one line and HTML for notebooks."""

import pytest

from mjnav import load_scenario, open_log, run

SCENE = ("crossing1", {"physics.engine": "kinematic", "time_limit": 1.0})


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    log = tmp_path_factory.mktemp("log") / "a.mcap"
    records = []
    result = run(load_scenario(*SCENE), seed=3, log=log, watch=records.append)
    return result, records[-1], open_log(log)


def test_what_holds_arrays_says_their_shapes_in_one_line(ran):
    result, record, log = ran
    shown = [record, record.truth, record.reading, record.belief, record.tracks[0], record.observation]
    shown += [record.decision, record.decision.costs, result, result.trajectory, log, load_scenario("hall")]
    for one in shown:
        assert repr(one).startswith(f"{type(one).__name__}(")
        assert "\n" not in repr(one)
        assert len(repr(one)) < 500
    assert "particles=<500 x 3>" in repr(record.belief)
    assert repr(result).startswith("Result('crossing1', rkhs, seed 3: timeout after 1.0 s, least clearance ")
    assert repr(load_scenario("hall")) == (
        "Scenario('hall', rkhs-plan, seed 0: 4 walls, 2 tables, 2 pillars, 5 people; noise pearson)"
    )
    assert f"{str(log.path)!r}: crossing1, rkhs, seed 3, 1.0 s" in repr(log)

"""Predictions measured over recordings, scenes and logs."""

from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.scene.crowd import read_recording
from mjnav.study.prediction import Frames, Plan, measure

QUICK = ("physics.engine=kinematic", "time_limit=3", "prediction.horizon=0.8")
ARCS = f"{Path(__file__).parents[2] / 'examples' / 'predictor' / 'arcs.py'}:Arcs"
MODELS = ("constant_velocity", ARCS)


@pytest.fixture
def recording(tmp_path):
    """One walks straight on at 1 m/s, one turns by a right angle at frame 12, one is there for six frames."""
    rows = [(10 * k, 1, 0.4 * k, 0.0) for k in range(24)]
    rows += [(10 * k, 2, 0.4 * min(k, 12), 50.0 + 0.4 * max(k - 12, 0)) for k in range(24)]
    rows += [(10 * k, 3, 0.4 * k, 90.0) for k in range(6)]
    file = tmp_path / "people.txt"
    file.write_text("\n".join("\t".join(map(str, row)) for row in sorted(rows)))
    return file


def test_constant_velocity_over_a_recording_by_hand(recording):
    found = measure(str(recording), Plan(("constant_velocity",), samples=3, exact=True, frame_rate=25.0))
    figures = found["models"]["constant_velocity"]
    # Rows 7 to 11 are seen with 8 frames before and 12 after: five windows of each of two people.
    assert [figures["people"], figures["predictions"], found["step_s"], found["steps"]] == [2, 10, 0.4, 12]
    # From row k, h steps ahead, the one who turns is |(0.4 n, -0.4 n)| off, n = k + h - 12 > 0.
    errors = np.array([[0.4 * np.sqrt(2.0) * max(k + h - 12, 0) for h in range(1, 13)] for k in range(7, 12)])
    assert figures["by_window"] == pytest.approx({"ade_m": 0.5 * errors.mean(), "fde_m": 0.5 * errors[:, -1].mean()})
    ade = figures["figures"]["ade_m"]
    assert ade["value"] == pytest.approx(0.5 * errors.mean())
    assert ade["interval"] == pytest.approx((0.0, errors.mean()), abs=1e-6)
    assert figures["figures"]["energy_m"]["value"] == pytest.approx(ade["value"])  # samples that are all alike


def test_people_who_are_never_at_a_step_are_left_out_and_somebody_has_to_be_left(tmp_path):
    file = tmp_path / "odd.txt"
    at_steps, between = ([(10 * k + shift, 1 + shift, 0.4 * k, 0.0) for k in range(4)] for shift in (0, 5))

    def frames(*rows):
        file.write_text("\n".join("\t".join(map(str, row)) for row in sorted(rows)))
        return Frames.of(read_recording(file), 25.0)

    assert len(frames(*at_steps, *between).places) == 1
    with pytest.raises(InvalidValue, match="nobody at the recording's own steps"):
        frames(*((10 * k, 1, 100.0 * k, 0.0) for k in range(4)))  # in pixels: no two rows are one walk


def test_a_window_with_a_gap_or_a_jump_in_it_is_left_out(tmp_path):
    file, plan = tmp_path / "people.txt", Plan(("constant_velocity",), exact=True, frame_rate=25.0)

    def measured(*rows):
        file.write_text("\n".join("\t".join(map(str, row)) for row in rows))
        return measure(str(file), plan)["models"]["constant_velocity"]

    whole = [(10 * k, 1, 0.4 * k, 0.0) for k in range(40)]
    assert measured(*whole)["predictions"] == 40 - 8 - 12 + 1
    gap = measured(*(row for row in whole if row[0] != 300))  # steps 0 to 29, and 31 to 39
    jump = measured(*((frame, one, x + 100.0 * (frame >= 300), y) for frame, one, x, y in whole))
    for found in (gap, jump):
        assert (found["people"], found["predictions"]) == (1, 30 - 8 - 12 + 1)
        assert found["by_window"]["ade_m"] == pytest.approx(0.0, abs=1e-6)


def test_a_log_of_a_model_of_ones_own_is_measured_by_others_too(tmp_path):
    prediction = {"prediction.model": ARCS, "prediction.memory": 0.5, "prediction.horizon": 0.8}
    mjnav.run(
        mjnav.load_scenario("crossing1", {"physics.engine": "kinematic", "time_limit": 3.0, **prediction}),
        log=tmp_path / "a.mcap",
    )
    found = measure(str(tmp_path / "a.mcap"), Plan(MODELS))
    assert (set(found["models"]), found["step_s"] * found["steps"]) == (set(MODELS), pytest.approx(0.8))


def test_where_people_were_between_steps_and_beyond_their_rows(recording):
    frames = Frames.of(read_recording(recording), 25.0)
    piece = next(piece for piece in frames.places if piece.startswith("3"))
    found = frames.whereabouts(piece, np.array([0.4, 1.0, 2.0, 2.2]))
    assert found[:3] == pytest.approx(np.array([[0.4, 90.0], [1.0, 90.0], [2.0, 90.0]]))
    assert np.isnan(found[3]).all()


def test_a_log_is_measured_again_with_the_same_figures_(tmp_path):
    scene = mjnav.load_scenario("crossing1", {"physics.engine": "kinematic", "time_limit": 3.0})
    mjnav.run(scene, seed=4, log=tmp_path / "a.mcap")
    first, again = (
        measure(str(tmp_path / "a.mcap"), Plan(MODELS, overrides=("prediction.horizon=0.8",))) for _ in range(2)
    )
    assert first == again
    assert first["models"][ARCS]["predictions"] == 6
    assert first["models"][ARCS]["figures"]["ade_m"]["interval"] is None  # no interval of one person


def test_whoever_walks_straight_is_foretold_exactly_where_the_truth_is_known():
    found = measure("crossing1", Plan(("constant_velocity",), exact=True, overrides=QUICK))["models"]
    assert found["constant_velocity"]["figures"]["fde_m"]["value"] == pytest.approx(0.0, abs=1e-6)
    assert found["constant_velocity"]["energy_beyond_first"]["value"] == 0.0


def test_nobody_is_foretold_to_come_again_elsewhere(tmp_path):
    file = tmp_path / "again.toml"
    file.write_text("""
schema = 1
name = "again"
robot = { start = [0.0, 0.0, 0.0], goal = [8.0, 0.0] }
[[people]]
start = [-1.0, 3.0]
behaviour = "waypoints"
waypoints = [[1.0, 3.0]]
at_end = "again"
trips = [{ from = [[-1.0, 3.0], [-1.0, 3.0]], to = [[1.0, 3.0], [1.0, 3.0]] }]
clear_of_robot = 0.5
again_within = 0.1
""")
    found = measure(str(file), Plan(("constant_velocity",), exact=True, overrides=(*QUICK, "time_limit=5")))
    figures = found["models"]["constant_velocity"]
    assert figures["predictions"] > 0
    assert figures["by_window"]["fde_m"] < 0.1  # the way begins 2 m behind its end

"""Trajectories for evo: what it reads is the run, and its error is mjnav's."""

import numpy as np
import pytest

from mjnav.log import open_log
from mjnav.log.export.export import export


@pytest.fixture(scope="module")
def evo(tmp_path_factory):
    """evo keeps its settings in the home folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(tmp_path_factory.mktemp("home")))
        from evo.core import metrics, sync
        from evo.tools import file_interface
    return file_interface, metrics, sync


def squared_errors(evo, folder, name) -> np.ndarray:
    """evo's absolute position errors of an estimate, squared."""
    file_interface, metrics, sync = evo
    truth, estimate = sync.associate_trajectories(
        file_interface.read_tum_trajectory_file(folder / f"{name}_truth.tum"),
        file_interface.read_tum_trajectory_file(folder / f"{name}_estimate.tum"),
    )
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, estimate))
    assert error.get_statistic(metrics.StatisticsType.rmse) == pytest.approx(np.sqrt(np.mean(error.error**2)))
    return error.error**2


def test_evos_errors_are_the_results(evo, driven, tmp_path):
    counts = export(driven, "tum", tmp_path / "out")
    assert counts["robot_truth.tum"] == counts["robot_estimate.tum"] + 1 == 21
    robot = squared_errors(evo, tmp_path / "out", "robot")
    assert np.sqrt(robot.mean()) == pytest.approx(driven.result["localization_rmse_m"], abs=1e-12)
    names = {name.split("_")[0] for name in counts} - {"robot"}
    people = np.concatenate([squared_errors(evo, tmp_path / "out", name) for name in names])
    assert people.size == 20 * len(driven.scenario().people) > 0
    assert np.sqrt(people.mean()) == pytest.approx(driven.result["tracking_rmse_m"], abs=1e-12)


def test_every_position_reads_back_to_the_last_bit(recorded, tmp_path):
    log = open_log(recorded)
    counts = export(log, "tum", tmp_path / "out")
    run = log.trajectory()
    headings = np.arctan2(run.people_velocity[..., 1], run.people_velocity[..., 0])
    for name, positions, turns in [
        ("robot_truth", run.robot_pose[:, :2], run.robot_pose[:, 2]),
        ("robot_estimate", run.estimate[:, :2], run.estimate[:, 2]),
        ("person1_truth", run.people_position[:, 1], headings[:, 1]),
        ("person1_estimate", run.tracks[:, 1, :2], np.arctan2(run.tracks[:, 1, 3], run.tracks[:, 1, 2])),
    ]:
        table = np.loadtxt(tmp_path / "out" / f"{name}.tum")
        assert table.shape == (len(positions), 8) == (counts[f"{name}.tum"], 8)
        assert table[:, 0].tolist() == [tick / 10 for tick in range(len(table))]
        np.testing.assert_array_equal(table[:, 1:3], positions)
        np.testing.assert_array_equal(table[:, 3:6], 0.0)
        turn = np.stack([np.sin(turns / 2), np.cos(turns / 2)], axis=-1)
        np.testing.assert_allclose(table[:, 6:], turn, rtol=0.0, atol=1e-15)  # NumPy's arctan2 is not math's


def test_a_person_without_a_track_or_a_finite_one_has_no_pose(recorded, tmp_path):
    counts = export(open_log(recorded), "tum", tmp_path / "out")
    assert (counts["person0_truth.tum"], counts["person0_estimate.tum"]) == (7, 4)
    times = np.loadtxt(tmp_path / "out" / "person0_estimate.tum")[:, 0]
    assert times.tolist() == [0.0, 0.1, 0.3, 0.5]

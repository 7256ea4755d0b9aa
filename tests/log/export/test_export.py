"""An export of any format is there whole or not at all, and replaces nothing."""

import numpy as np
import pytest
from mcap.writer import Writer

from mjnav.errors import DamagedLogError, InputError, MjnavError
from mjnav.log import open_log
from mjnav.log.export.export import FORMATS, check_new_folder, export


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("error", [KeyboardInterrupt, MjnavError])
def test_an_export_that_is_interrupted_leaves_nothing(recorded, tmp_path, form, error):
    def interrupted(time):
        if time > 0.35:
            raise error

    with pytest.raises(error):
        export(open_log(recorded), form, tmp_path / "out", progress=interrupted)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("form", FORMATS)
def test_a_foreign_message_is_an_error_of_one_line_and_leaves_nothing(recorded, tmp_path, form):
    whole, path = open_log(recorded), tmp_path / "strange.mcap"
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjnav/run", dict(whole.run or {}))
        writer.add_attachment(0, 0, "scenario.toml", "application/toml", whole.attachments["scenario.toml"])
        channel = writer.register_channel("/robot/state", "json", 0)
        writer.add_message(channel, 0, b'{"tick": 0, "place": [1, 2, 3]}', 0)
        writer.finish()
    with pytest.raises(DamagedLogError, match=r"holds a message that is not one of mjnav's \(KeyError\('\w+'\)\)$"):
        export(open_log(path), form, tmp_path / "out")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("kind", ["file", "full folder", "link to nothing"])
def test_an_existing_file_or_folder_is_kept(tmp_path, kind):
    path = tmp_path / "out"
    if kind == "file":
        path.write_text("mine")
    elif kind == "full folder":
        path.mkdir()
        (path / "mine").touch()
    else:
        path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="exists already"):
        check_new_folder(path)
    assert [found.name for found in tmp_path.iterdir()] == ["out"]


# ------------------------------------------------------------------------------- trajectories (TUM)


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

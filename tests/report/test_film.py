"""A run's moments and the film of them."""

from math import pi

import numpy as np
import pytest
from PIL import Image

from mjnav.messages import Trajectory
from mjnav.report.log_pictures import frame_at, frame_times, write_film, write_gif

av = pytest.importorskip("av", reason="av is not installed")


def trajectory() -> Trajectory:
    """Three states a second apart, two ticks, one person."""
    zeros = np.zeros
    return Trajectory(
        time=np.array([0.0, 1.0, 2.0]),
        robot_pose=np.array([[0.0, 0.0, 3.0], [1.0, 2.0, -3.0], [2.0, 2.0, -3.0]]),
        robot_twist=zeros((3, 2)),
        people_position=np.array([[[5.0, 0.0]], [[4.0, 1.0]], [[3.0, 1.0]]]),
        people_velocity=zeros((3, 1, 2)),
        estimate=zeros((2, 3)),
        estimate_triangle=zeros((2, 6)),
        tracks=np.array([[[5.0, 0.0, -1.0, 1.0]], [[4.0, 1.0, -1.0, 0.0]]]),
        track_triangle=zeros((2, 1, 10)),
        robot_ess=zeros(2),
        robot_particles=zeros(2),
        people_ess=zeros((2, 1)),
        command=zeros((2, 2)),
        decision=zeros((2, 2)),
        nominal=zeros((2, 2)),
        status=("ok", "ok"),
        contacts=(),
        timing=zeros((0, 7), np.int64),
        deadline_misses=0,
    )


def test_a_film_has_a_frame_at_its_start_and_every_step_of_the_run_until_its_end():
    assert frame_times(1.0, 0.25) == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    assert frame_times(0.9, 0.25) == pytest.approx([0.0, 0.25, 0.5, 0.75])
    assert len(frame_times(26.5, 0.04)) == 663


def test_between_ticks_all_moves_in_proportion_and_headings_the_shorter_way():
    state, beside = frame_at(trajectory(), 0.25)
    x, y, heading = state.robot_pose
    assert (x, y) == pytest.approx((0.25, 0.5))
    assert heading == pytest.approx(3.0 + 0.25 * (2.0 * pi - 6.0))  # through pi, not back through 0
    assert state.people_position == pytest.approx(np.array([[4.75, 0.25]]))
    assert beside["tracks"] == pytest.approx(np.array([[4.75, 0.25, -1.0, 0.75]]))
    assert beside["trail"] == pytest.approx(np.array([[0.0, 0.0], [0.25, 0.5]]))


def test_a_film_is_what_browsers_play_and_shows_its_frames_in_order(tmp_path):
    grey = [np.full((48, 64, 3), 20 * k, np.uint8) for k in range(12)]
    path = tmp_path / "a.mp4"
    assert write_film(path, iter(grey), fps=8) == 12
    with av.open(str(path)) as film:
        (stream,) = film.streams
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.average_rate) == (64, 48, 8)
        assert float(stream.duration * stream.time_base) == pytest.approx(12 / 8)
        shown = [frame.to_ndarray(format="rgb24").mean() for frame in film.decode(stream)]
    assert shown == pytest.approx([20.0 * k for k in range(12)], abs=3.0)
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # plays before all of it is there


def test_a_gif_repeats_its_frames_in_order(tmp_path):
    grey = [np.full((48, 64, 3), 20 * k, np.uint8) for k in range(12)]
    grey[0][:, 32:] = np.linspace(0, 255, 32, dtype=np.uint8)[None, :, None]  # whose colours are the film's
    path = tmp_path / "a.gif"
    assert write_gif(path, iter(grey), fps=8) == 12
    with Image.open(path) as film:
        assert (film.n_frames, film.size, film.info["loop"], film.info["duration"]) == (12, (64, 48), 0, 120)
        shown = []
        for k in range(12):
            film.seek(k)
            shown.append(np.asarray(film.convert("RGB"))[:, :32].mean())
    assert shown == pytest.approx([20.0 * k for k in range(12)], abs=10.0)


def test_what_comes_into_a_gif_later_has_its_colour(tmp_path):
    frames = [np.full((48, 64, 3), 180, np.uint8) for _ in range(20)]
    for k in range(10, 20):
        frames[k][20:22, k : k + 20] = (150, 30, 220)  # a thin line in violet
    write_gif(tmp_path / "a.gif", iter(frames), fps=8)
    with Image.open(tmp_path / "a.gif") as film:
        film.seek(film.n_frames - 5)
        assert np.asarray(film.convert("RGB"))[20, 25] == pytest.approx((150, 30, 220), abs=12)


@pytest.mark.parametrize("fps", [8, 12, 30, 50])
def test_a_gif_lasts_as_long_as_its_frames(tmp_path, fps):
    """Its delays are hundredths of a second."""
    path, num = tmp_path / "a.gif", 25
    rainbow = np.linspace(0, 255, 64, dtype=np.uint8)[None, :, None] * np.ones((48, 1, 3), np.uint8)
    write_gif(path, (np.roll(rainbow, k, axis=1) for k in range(num)), fps=fps)
    with Image.open(path) as film:
        lasting = [film.seek(k) or film.info["duration"] for k in range(num)]
    assert sum(lasting) == pytest.approx(1000.0 * num / fps, abs=5.0)

"""A moment of a logged run as a picture, and the run as a film: `mjnav render` and `mjnav.render`.

A film shows the run's states at and between ticks, in a file that browsers play.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from math import ceil
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import DamagedLogError, InputError, InvalidValue, of_extra
from mjnav.geometry.angles import wrap
from mjnav.log.read.log import Log, open_log
from mjnav.messages import Array, Trajectory, WorldState, number
from mjnav.output_files import output_path, replacement, written
from mjnav.report.lidar_view import LoggedViews

if TYPE_CHECKING:
    from PIL.Image import Image

# ---------------------------------------------------------------------------------------------- films


CODEC = "libx264"
QUALITY = "23"  # of x264's scale from 0, lossless, to 51
_MAX_FPS = 120


def frame_at(trajectory: Trajectory, time: float) -> tuple[WorldState, dict[str, Array]]:
    """A run at any time within it [s]: linear between two ticks, headings the shorter way round.

    With the state, what is drawn beside it: the `trail` (n, 2) of the robot up to here, and of people the `tracks`
    (P, 4), believed x, y, vx, vy; NaN for who has no track.
    """
    t = trajectory
    last = len(t.time) - 1
    before = min(max(int(np.searchsorted(t.time, time, side="right")) - 1, 0), last)
    after = min(before + 1, last)
    share = 0.0 if after == before else (time - t.time[before]) / (t.time[after] - t.time[before])

    def between(rows: Array, start: int = before, end: int = after) -> Array:
        return rows[start] + share * (rows[end] - rows[start])

    pose = between(t.robot_pose)
    turn = wrap(t.robot_pose[after, 2] - t.robot_pose[before, 2])
    pose[2] = wrap(t.robot_pose[before, 2] + share * turn)
    state = WorldState(
        time=time,
        robot_pose=pose,
        robot_twist=between(t.robot_twist),
        people_position=between(t.people_position),
        people_velocity=between(t.people_velocity),
        people_radius=None if t.people_radius is None else t.people_radius[before],
    )
    num_ticks = len(t.tracks)  # the last state has no belief
    if num_ticks:
        tracks = between(t.tracks, min(before, num_ticks - 1), min(after, num_ticks - 1))
    else:
        tracks = np.full((len(state.people_position), 4), np.nan)
    return state, {"trail": np.vstack([t.robot_pose[: before + 1, :2], pose[:2]]), "tracks": tracks}


def require_codec() -> None:
    """Raises InputError where films cannot be written here."""
    with of_extra("av", "video"):
        import av
    if CODEC not in av.codecs_available:
        raise InputError(f"the installed av has no {CODEC}: pip install --force-reinstall av brings one that has")


def write_film(path: str | PathLike[str], frames: Iterable[NDArray[np.uint8]], fps: int) -> int:
    """Writes `frames` (height, width, 3), all of one size with even sides, as an MP4 file; returns how many there were.

    H.264 with the index in front: browsers play it while it comes. Raises OSError for what the disk refuses.
    """
    import av

    count = 0
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = film.add_stream(CODEC, rate=Fraction(fps), options={"crf": QUALITY})
        stream.pix_fmt = "yuv420p"  # the only one that all browsers play
        for pixels in frames:
            if count == 0:
                stream.height, stream.width = pixels.shape[:2]
            film.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
            count += 1
        film.mux(stream.encode())
    return count


GIF, MOST_OF_GIF = ".gif", 50  # frames a second
FILMS = (".mp4", GIF)
COLOURS = 64  # of a GIF


def write_gif(path: str | PathLike[str], frames: Iterable[NDArray[np.uint8]], fps: int) -> int:
    """Writes frames (height, width, 3) as a GIF that repeats; returns how many there were.

    Its colours are those of some frames, from the first to the last. Raises OSError for what the disk refuses.
    """
    from PIL import Image

    every = [*frames]
    some = Image.fromarray(np.concatenate(every[:: ceil(len(every) / 8)]))
    palette = some.quantize(COLOURS, Image.Quantize.FASTOCTREE)  # which keeps those of small things
    first, *rest = (Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE) for pixels in every)
    hundredths = np.diff(np.round(100.0 / fps * np.arange(len(every) + 1))).astype(int)  # as whole ones as a GIF has
    first.save(path, save_all=True, append_images=rest, duration=(10 * hundredths).tolist(), loop=0, optimize=True)
    return len(every)


# --------------------------------------------------------------------------------------------- render


PICTURE_SIZE, FILM_SIZE = (1280, 560), (960, 540)  # [pixels]
FPS = 25
SIDES = (64, 4096)  # [pixels] the least and the largest
_PERIOD_ERROR = 1e-6  # of a period, at most, that sums of physics steps are off

LogOrPath = Log | str | os.PathLike[str]


@overload
def render(
    log: LogOrPath, output: None = None, *, at: float | None = None, size: tuple[int, int] | None = None
) -> "Image": ...
@overload
def render(
    log: LogOrPath,
    output: str | os.PathLike[str],
    *,
    at: float | None = None,
    size: tuple[int, int] | None = None,
    fps: int = FPS,
    speed: float = 1.0,
) -> Path: ...
def render(
    log: LogOrPath,
    output: str | os.PathLike[str] | None = None,
    *,
    at: float | None = None,
    size: tuple[int, int] | None = None,
    fps: int = FPS,
    speed: float = 1.0,
) -> "Image | Path":
    """Draws a moment of a run, or films it. Returns the picture (PIL), or the path where `output` names a file.

    `output` is a picture, .png, or a film, .mp4 or .gif, which replaces a file of that name. `at` is the time of a
    picture [s], the end of the run by default; a film goes `speed` times as fast as the run, with `fps` frames a
    second. `size` is (width, height) in pixels. Raises InputError where it cannot be drawn,
    MjnavError where the disk refuses, and DamagedLogError for a damaged log.
    """
    path = None if output is None else output_path("output", output, ".png", *FILMS)
    log = log if isinstance(log, Log) else open_log(log)
    if path is not None and path.suffix.lower() in FILMS:
        if at is not None:
            raise InvalidValue("at", at, "nothing, for a film")
        film(log, path, film_times(log, fps, speed), fps, size)
        return path
    from PIL import Image

    pixels, _ = picture(log, at, size=size)
    if path is None:
        return Image.fromarray(pixels)
    save_picture(pixels, path)
    return path


def save_picture(pixels: NDArray[np.uint8], path: Path) -> None:
    """Writes a picture (height, width, 3) as PNG."""
    from PIL import Image

    with written(path) as file:
        Image.fromarray(pixels).save(file, format="png", optimize=True)


def picture(log: Log, at: float | None, *, size: tuple[int, int] | None) -> tuple[NDArray[np.uint8], float]:
    """The scene at the tick nearest to `at` [s], (height, width, 3), and the time of that tick; else the end."""
    from mjnav.world.render import render as draw

    size = _checked_size(size or PICTURE_SIZE, even=False)
    run, _ = log.whole_ticks()  # also behind a gap
    trajectory = log.trajectory() if run is None else run.trajectory
    last = len(trajectory.time) - 1
    if at is not None and not 0.0 <= number("at", at, "s") <= trajectory.time[last]:
        raise InvalidValue("at", at, f"a time from 0 to {trajectory.time[last]:g} s")
    index = last if at is None else int(np.abs(trajectory.time - at).argmin())
    state, beside = frame_at(trajectory, float(trajectory.time[index]))
    drawn: dict[str, Any] = beside | LoggedViews(log).at(state.time)
    return draw(log.scenario(), state, size=size, legend=True, **drawn), state.time


def film_times(log: Log, fps: int, speed: float) -> Array:
    """The simulated time of each frame [s] of a run `speed` times as fast as it was; the last is not after its end.

    Raises DamagedLogError where the run's states are not a period apart.
    """
    if not isinstance(fps, int) or not 1 <= fps <= _MAX_FPS:
        raise InvalidValue("fps", fps, f"a whole number from 1 to {_MAX_FPS}")
    if not 0.01 <= number("speed", speed) <= 100.0:
        raise InvalidValue("speed", speed, "a number from 0.01 to 100")
    trajectory = log.trajectory()
    _check_times(log, trajectory)
    return frame_times(float(trajectory.time[-1]), speed / fps)


def frame_times(end: float, step: float) -> Array:
    """From 0 on, `step` apart [s]; the last one is not after the end."""
    return np.minimum(step * np.arange(int(end / step + 1e-6) + 1), end)


def film(
    log: Log,
    path: Path,
    times: Array,
    fps: int,
    size: tuple[int, int] | None,
    progress: Callable[[int], None] = lambda number: None,
) -> None:
    """Films a run at these times; `progress` gets the number of every frame before it is encoded."""
    from mjnav.world.render import Renderer

    if path.suffix.lower() == GIF and fps > MOST_OF_GIF:
        raise InvalidValue("fps", fps, f"at most {MOST_OF_GIF} for a GIF, of which viewers show no more")
    size, write = _checked_size(size or FILM_SIZE, even=True), write_gif if path.suffix.lower() == GIF else write_film
    if write is write_film:
        require_codec()
    run, trajectory, views = log.run or {}, log.trajectory(), LoggedViews(log)
    title = ", ".join(run[key] for key in ("scene", "controller") if key in run)

    def frames() -> Iterator[NDArray[np.uint8]]:
        with Renderer(log.scenario(), trajectory.robot_pose[:, :2], size=size, quick=True) as renderer:
            for number, time in enumerate(times.tolist()):
                progress(number)
                state, beside = frame_at(trajectory, time)
                drawn: dict[str, Any] = beside | views.at(time)
                yield renderer.draw(state, text=f"{title}\n{time:.1f} s", legend=True, **drawn)

    with replacement(path) as partial:
        write(partial, frames(), fps)


def _checked_size(size: tuple[int, int], *, even: bool) -> tuple[int, int]:
    sides = size if isinstance(size, tuple | list) and len(size) == 2 else ()
    fit = [isinstance(side, Integral) and SIDES[0] <= side <= SIDES[1] and not (even and side % 2) for side in sides]
    if not fit or not all(fit):
        kind = "even numbers" if even else "numbers"
        raise InvalidValue("size", size, f"(width, height), {kind} from {SIDES[0]} to {SIDES[1]}")
    return size


def _check_times(log: Log, trajectory: Trajectory) -> None:
    """Raises DamagedLogError where a state is earlier than the one before, or more than a period later.

    A film has frames for all the time between the first state and the last: two states may say a thousand years.
    """
    steps, period = np.diff(trajectory.time, prepend=0.0), log.scenario().control.period
    if not ((steps >= 0.0) & (steps <= period * (1.0 + _PERIOD_ERROR))).all():  # a NaN is neither
        raise DamagedLogError(
            f"{log.path}: damaged: its {len(steps)} states are not {period:g} s apart: the times go from "
            f"{trajectory.time.min():g} to {trajectory.time.max():g} s, and no film is made of that"
        )

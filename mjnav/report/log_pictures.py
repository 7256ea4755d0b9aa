"""A moment of a logged run as a picture, and the run as a film: `mjnav render` and `mjnav.render`."""

import os
from collections.abc import Callable, Iterator
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import DamagedLogError, InvalidValue
from mjnav.messages import Trajectory, number
from mjnav.output_files import output_path, replacement, written
from mjnav.recording.read.log import Log, open_log
from mjnav.report.film import FilmTiming, frame_at, require_codec, write_film
from mjnav.report.lidar_view import LidarViews
from mjnav.report.plan_view import PlanViews

if TYPE_CHECKING:
    from PIL.Image import Image

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
    start: float = 0.0,
    end: float | None = None,
) -> Path: ...
def render(
    log: LogOrPath,
    output: str | os.PathLike[str] | None = None,
    *,
    at: float | None = None,
    size: tuple[int, int] | None = None,
    fps: int = FPS,
    speed: float = 1.0,
    start: float = 0.0,
    end: float | None = None,
) -> "Image | Path":
    """Draws a moment of a run, or films it. Returns the picture, or the path where `output` names a file.

    `output` is a picture, .png, or a film, .mp4, which replaces a file of that name. `at` is the time of a picture [s],
    the end of the run by default; a film goes from `start` to `end` [s], `speed` times as fast as the run, with `fps`
    frames a second. `size` is (width, height) in pixels. Raises InputError where it cannot be drawn or written, and
    DamagedLogError for a damaged log.
    """
    path = None if output is None else output_path("output", output, ".png", ".mp4")
    log = log if isinstance(log, Log) else open_log(log)
    is_film = path is not None and path.suffix.lower() == ".mp4"
    if size is not None:
        _check_size(size, even=is_film)
    if path is not None and is_film:
        if at is not None:
            raise InvalidValue("at", at, "start and end, for a film")
        require_codec()
        film = Film(log, size or FILM_SIZE)
        film.write(path, film.timing(start, end, fps=fps, speed=speed))
        return path
    from PIL import Image

    pixels, _ = picture(log, at, size=size or PICTURE_SIZE)
    image = Image.fromarray(pixels)
    if path is None:
        return image
    with written(path) as file:
        image.save(file, format="png", optimize=True)
    return path


def picture(log: Log, at: float | None = None, *, size: tuple[int, int]) -> tuple[NDArray[np.uint8], float]:
    """The scene at the tick nearest to `at` [s], (height, width, 3), and the time of that tick; else the end."""
    from mjnav.world.render import render as draw

    trajectory = log.trajectory()
    last = len(trajectory.time) - 1
    if at is not None and not 0.0 <= number("at", at, "s") <= trajectory.time[last]:
        raise InvalidValue("at", at, f"a time from 0 to {trajectory.time[last]:g} s")
    index = last if at is None else int(np.abs(trajectory.time - at).argmin())
    shown = frame_at(trajectory, float(trajectory.time[index]))
    drawn = LidarViews(log).at(shown.state.time).drawn | PlanViews(log).at(shown.state.time)
    return draw(log.scenario(), shown.state, size=size, trail=shown.trail, **drawn), shown.state.time


class Film:
    """A run as a film. Raises DamagedLogError where its states are not a period apart."""

    def __init__(self, log: Log, size: tuple[int, int]):
        self._log, self._size, self._trajectory = log, size, log.trajectory()
        _check_times(log, self._trajectory)

    def timing(self, start: float | None, end: float | None, *, fps: int, speed: float) -> FilmTiming:
        """From `start` to `end` [s], by default the whole run. Raises InvalidValue."""
        last = float(self._trajectory.time[-1])
        for name, given in (("start", start), ("end", end)):
            if given is not None and not 0.0 <= number(name, given, "s") <= last:
                raise InvalidValue(name, given, f"a time from 0 to {last:g} s")
        return FilmTiming(start or 0.0, last if end is None else end, fps, speed)

    def write(self, path: Path, timing: FilmTiming, *, progress: Callable[[int], None] = lambda number: None) -> None:
        """Writes the film; `progress` gets the number of every frame before it is encoded."""
        with replacement(path) as partial:
            write_film(partial, self._frames(timing, progress), timing.fps)

    def _frames(self, timing: FilmTiming, progress: Callable[[int], None]) -> Iterator[NDArray[np.uint8]]:
        from mjnav.world.render import Renderer

        run, trajectory = self._log.run or {}, self._trajectory
        title = ", ".join(run[key] for key in ("scene", "controller") if key in run)
        floor, views, plans = trajectory.robot_pose[:, :2], LidarViews(self._log), PlanViews(self._log)
        with Renderer(self._log.scenario(), floor, size=self._size, quick=True) as renderer:
            for number, time in enumerate(timing.times().tolist()):
                progress(number)
                shown = frame_at(trajectory, time)
                text = f"{title}\n{time:.1f} s"
                beliefs: dict[str, Any] = {"tracks": shown.tracks} | views.at(time).drawn | plans.at(time)
                yield renderer.draw(shown.state, trail=shown.trail, text=text, **beliefs)


def _check_size(size: tuple[int, int], *, even: bool) -> None:
    sides = size if isinstance(size, tuple | list) and len(size) == 2 else ()
    fit = [isinstance(side, Integral) and SIDES[0] <= side <= SIDES[1] and not (even and side % 2) for side in sides]
    if not fit or not all(fit):
        kind = "even numbers" if even else "numbers"
        raise InvalidValue("size", size, f"(width, height), {kind} from {SIDES[0]} to {SIDES[1]}")


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

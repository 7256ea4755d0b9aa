"""`mjnav render LOG -o OUT.png | OUT.mp4`: the scene at one moment of a run, or the run as a film."""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mjnav.cli.options.checks import check_needs
from mjnav.cli.terminal.interrupt import interruptible
from mjnav.cli.terminal.progress import progress
from mjnav.errors import DamagedLogError, InvalidValue
from mjnav.messages import Trajectory
from mjnav.output_files import output_path, replacement, written
from mjnav.recording import Log, open_log
from mjnav.report.film import FilmTiming, frame_at, require_codec, write_film

PICTURE_SIZE, FILM_SIZE = (1280, 560), (960, 540)  # [pixels]
SIDES = (64, 4096)  # [pixels] the least and the largest
FPS = 25
_PERIOD_ERROR = 1e-6  # of a period, at most, that sums of physics steps are off
_FILM_ONLY = ("fps", "speed", "from", "to")


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="the log of a run")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="a picture, .png, or a film, .mp4")
    parser.add_argument("--size", metavar="WxH", help="in pixels; {}x{}, films {}x{}".format(*PICTURE_SIZE, *FILM_SIZE))
    parser.add_argument("--at", type=float, metavar="T", help="time of a picture [s]; the end of the run by default")
    parser.add_argument("--fps", type=int, metavar="N", help=f"frames per second of a film; {FPS} by default")
    parser.add_argument("--speed", type=float, metavar="X", help="play a film X times as fast as the run; 1 by default")
    parser.add_argument("--from", type=float, metavar="T", help="time at which a film begins [s]; the start by default")
    parser.add_argument("--to", type=float, metavar="T", help="time at which a film ends [s]; the end by default")


def execute(arguments: argparse.Namespace) -> int:
    """Draws off screen."""
    output = output_path("--output", arguments.output, ".png", ".mp4")
    film = output.suffix.lower() == ".mp4"
    check_needs("--at", "a picture: -o OUT.png", given=arguments.at is not None, met=not film)
    for name in _FILM_ONLY:
        check_needs(f"--{name}", "a film: -o OUT.mp4", given=getattr(arguments, name) is not None, met=film)
    size = _size(arguments.size, even=film) or (FILM_SIZE if film else PICTURE_SIZE)
    if film:
        require_codec()
    log = open_log(arguments.log)
    log.scenario()  # says best what another program's file lacks
    if film:
        _film(arguments, output, log, size)
    else:
        _picture(arguments, output, log, size)
    return 0


def _size(given: str | None, *, even: bool) -> tuple[int, int] | None:
    if given is None:
        return None
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", given)
    sides = tuple(map(int, found.groups())) if found else ()
    if not sides or not all(SIDES[0] <= side <= SIDES[1] and not (even and side % 2) for side in sides):
        kind = "even numbers" if even else "numbers"
        raise InvalidValue("--size", given, f"WIDTHxHEIGHT, {kind} from {SIDES[0]} to {SIDES[1]}")
    width, height = sides
    return width, height


def _picture(arguments: argparse.Namespace, output: Path, log: Log, size: tuple[int, int]) -> None:
    from PIL import Image

    from mjnav.world.render import render

    trajectory = log.trajectory()
    index = _index(trajectory, arguments.at)
    shown = frame_at(trajectory, float(trajectory.time[index]))
    pixels = render(log.scenario(), shown.state, size=size, trail=shown.trail)
    with written(output) as file:
        Image.fromarray(pixels).save(file, format="png", optimize=True)
    print(f"{output}: {shown.state.time:.1f} s")


def _index(trajectory: Trajectory, time: float | None) -> int:
    """The tick nearest to `time`, the last one by default."""
    last = len(trajectory.time) - 1
    if time is None:
        return last
    if not 0.0 <= time <= trajectory.time[last]:
        raise InvalidValue("--at", time, f"a time from 0 to {trajectory.time[last]:g} s")
    return int(np.abs(trajectory.time - time).argmin())


def _film(arguments: argparse.Namespace, output: Path, log: Log, size: tuple[int, int]) -> None:
    trajectory = log.trajectory()
    _check_times(log, trajectory)
    timing = _timing(arguments, float(trajectory.time[-1]))
    times = timing.times().tolist()
    name = output.name
    with interruptible() as interrupted, progress(name, len(times), unit="frames") as show, replacement(output) as file:

        def frames() -> Iterator[NDArray[np.uint8]]:
            for number, pixels in enumerate(_frames(log, trajectory, times, size)):
                if interrupted.is_set():
                    raise KeyboardInterrupt
                show(number)
                yield pixels

        write_film(file, frames(), timing.fps)
    print(f"{output}: {len(times)} frames, {len(times) / timing.fps:.1f} s, {1e-6 * output.stat().st_size:.1f} MB")


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


def _timing(arguments: argparse.Namespace, last: float) -> FilmTiming:
    """What was asked for; `last` is the time of the last state [s]."""
    start, end = getattr(arguments, "from"), arguments.to
    for name, given in (("--from", start), ("--to", end)):
        if given is not None and not 0.0 <= given <= last:
            raise InvalidValue(name, given, f"a time from 0 to {last:g} s")
    start, end = start or 0.0, last if end is None else end
    fps = FPS if arguments.fps is None else arguments.fps
    speed = 1.0 if arguments.speed is None else arguments.speed
    names = {"start": "from", "fps": "fps", "speed": "speed"}
    try:
        return FilmTiming(start, end, fps, speed)
    except InvalidValue as error:
        raise InvalidValue(f"--{names[error.key]}", error.found, error.allowed) from None


def _frames(log: Log, trajectory: Trajectory, times: list[float], size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    from mjnav.world.render import Renderer

    run = log.run or {}
    title = ", ".join(run[key] for key in ("scene", "controller") if key in run)
    with Renderer(log.scenario(), trajectory.robot_pose[:, :2], size=size, quick=True) as renderer:
        for time in times:
            shown = frame_at(trajectory, time)
            text = f"{title}\n{time:.1f} s"
            yield renderer.draw(shown.state, trail=shown.trail, tracks=shown.tracks, text=text)

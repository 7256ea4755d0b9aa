"""`mjnav render LOG -o OUT.png | OUT.mp4 | OUT.gif`: the scene at one moment of a run, or the run as a film."""

import argparse
import re

import numpy as np

from mjnav.cli import options
from mjnav.cli.terminal import stoppable, tell
from mjnav.errors import InvalidValue
from mjnav.log import open_log
from mjnav.output_files import output_path
from mjnav.report.log_pictures import FILM_SIZE, FILMS, FPS, PICTURE_SIZE, film, film_times, picture, save_picture

_FILM_ONLY = {"fps": "--fps", "speed": "--speed"}


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="the log of a run")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="a picture, .png, or a film, .mp4 or .gif")
    parser.add_argument("--size", metavar="WxH", help="in pixels; {}x{}, films {}x{}".format(*PICTURE_SIZE, *FILM_SIZE))
    parser.add_argument("--at", type=float, metavar="T", help="time of a picture [s]; the end of the run by default")
    parser.add_argument("--fps", type=int, metavar="N", help=f"frames per second of a film; {FPS} by default")
    parser.add_argument("--speed", type=float, metavar="X", help="play a film X times as fast as the run; 1 by default")


def execute(arguments: argparse.Namespace) -> int:
    """Draws off screen."""
    output = output_path("--output", arguments.output, ".png", *FILMS)
    is_film = output.suffix.lower() in FILMS
    options.check_needs("--at", "a picture: -o OUT.png", given=arguments.at is not None, met=not is_film)
    for name, option in _FILM_ONLY.items():
        given = getattr(arguments, name) is not None
        options.check_needs(option, "a film: -o OUT.mp4 or OUT.gif", given=given, met=is_film)
    size = _size(arguments.size)
    log = open_log(arguments.log)
    log.scenario()  # says best what another program's file lacks
    if not is_film:
        pixels, time = picture(log, arguments.at, size=size)
        save_picture(pixels, output)
        print(f"{output}: {time:g} s")
        return 0
    fps = FPS if arguments.fps is None else arguments.fps
    times = film_times(log, fps, 1.0 if arguments.speed is None else arguments.speed)
    with stoppable(output.name, len(times), "frames") as step:
        film(log, output, times, fps, size, step)
    print(f"{output}: {len(times)} frames, {len(times) / fps:.1f} s, {1e-3 * output.stat().st_size:.0f} kB")
    run, _ = log.whole_ticks()
    gaps = [] if run is None else np.flatnonzero(np.diff(run.ticks) > 1).tolist()
    if run is not None and gaps:
        tell(f"{arguments.log} lacks ticks after {run.trajectory.time[gaps[0]]:g} s, where the film ends")
    return 0


def _size(given: str | None) -> tuple[int, int] | None:
    if given is None:
        return None
    sides = re.fullmatch(r"(\d{1,9})x(\d{1,9})", given)
    if sides is None:
        raise InvalidValue("--size", given, "WIDTHxHEIGHT in pixels")
    return int(sides[1]), int(sides[2])

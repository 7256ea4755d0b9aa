"""Options of the commands that run a scene: its name or path, and values that replace its own."""

import argparse
import math
from functools import partial

from mjnav.errors import InvalidValue
from mjnav.loop.supervision import MAX_SECONDS
from mjnav.scene.overrides import Override


def configure(parser: argparse.ArgumentParser) -> None:
    """SCENE, --start, --goal, --seed, --controller and --set."""
    scene(parser)
    start_and_goal(parser)
    parser.add_argument("--seed", type=int, metavar="N", help="seed, in place of the run file's")
    parser.add_argument(
        "--controller", metavar="NAME", help="controller with its default parameters, in place of the run file's"
    )
    overrides(parser)


def scene(parser: argparse.ArgumentParser) -> None:
    """SCENE."""
    parser.add_argument(
        "scene", metavar="SCENE", help="a shipped scene's name, or the path of a run file, map or world"
    )


def start_and_goal(parser: argparse.ArgumentParser) -> None:
    """--start and --goal, which a map and a world lack."""
    for option, point in (("--start", "X,Y,HEADING"), ("--goal", "X,Y")):
        parser.add_argument(
            option,
            action="append",
            default=[],
            type=partial(_point, option, point),
            dest="overrides",
            metavar=point,
            help=f"the robot's, [m{' and rad' if 'HEADING' in point else ''}], in place of the run file's",
        )


def _point(option: str, allowed: str, text: str) -> Override:
    """The numbers of an option as the key of a run file."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != allowed.count(",") + 1:
        raise argparse.ArgumentTypeError(f"found {text!r}; allowed: {allowed}, numbers in one word")
    return Override(f"robot.{option[2:]}", numbers, option)


def overrides(parser: argparse.ArgumentParser) -> None:
    """--set."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=_override,
        dest="overrides",
        metavar="KEY=VALUE",
        help="replace any value of the run file, for example people.0.radius=0.4; may be repeated",
    )


def _override(text: str) -> str:
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"found {text!r}; allowed: KEY=VALUE in one word, as in --set {text}=VALUE")
    return text


def max_seconds(parser: argparse.ArgumentParser) -> None:
    """--max-seconds."""
    parser.add_argument(
        "--max-seconds",
        type=float,
        metavar="S",
        help=f"wall time after which an episode is ended; {MAX_SECONDS:g} by default",
    )


def checked_max_seconds(arguments: argparse.Namespace, extra: float = 0.0) -> float:
    """The value of --max-seconds; without one, the default and `extra`. Raises InvalidValue."""
    value = arguments.max_seconds
    if value is None:
        return MAX_SECONDS + extra
    if not 0.0 < value < math.inf:
        raise InvalidValue("--max-seconds", value, "a number of seconds > 0")
    return value

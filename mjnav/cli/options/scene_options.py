"""Options of the commands that run a scene: its name or path, and values that replace its own."""

import argparse
import math

from mjnav.errors import InvalidValue
from mjnav.loop.supervision import MAX_SECONDS


def configure(parser: argparse.ArgumentParser) -> None:
    """SCENE, --seed, --controller and --set."""
    scene(parser)
    parser.add_argument("--seed", type=int, metavar="N", help="seed, in place of the run file's")
    parser.add_argument(
        "--controller", metavar="NAME", help="controller with its default parameters, in place of the run file's"
    )
    overrides(parser)


def scene(parser: argparse.ArgumentParser) -> None:
    """SCENE."""
    parser.add_argument("scene", metavar="SCENE", help="a shipped scene's name, or the path of a run file")


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

"""Options that several commands share, and checks that the parser cannot make: these raise InputError.

SCENE and values that replace its own; where many episodes run; --require, so that a command can be a check of a user's
own CI.
"""

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from mjnav.cli.terminal import tell
from mjnav.errors import InputError, InvalidValue
from mjnav.loop.supervision import MAX_SECONDS
from mjnav.scene.overrides import Override
from mjnav.settings import Range, settled

if TYPE_CHECKING:
    from mjnav.scene.spec import Scenario
    from mjnav.study.requirements import Answer, Requirement
    from mjnav.study.sweep.schedulers import Scheduler

# --------------------------------------------------------------------------------------------- checks


def check_needs(option: str, needed: str, *, given: bool, met: bool) -> None:
    """An option that was given has what it needs: `--port needs --live`."""
    if given and not met:
        raise InputError(f"{option} needs {needed}")


def number(kind: type, low: float, high: float, unit: str = "", *, open_low: bool = False) -> Callable[[str], Any]:
    """The `type` of an option that takes a number from `low` to `high`."""
    hint = Annotated[kind, Range(low, high, unit, open_low)]

    def read(text: str) -> Any:
        try:
            return settled(hint, kind(text))
        except InvalidValue as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    read.__name__ = kind.__name__  # which argparse says of a text that is none
    return read


# -------------------------------------------------------------------------------------------- a scene


def run(parser: argparse.ArgumentParser) -> None:
    """SCENE, --start, --goal, --seed, --controller and --set."""
    parser.add_argument(
        "scene", metavar="SCENE", help="a shipped scene's name, or the path of a run file, map or world"
    )
    start_and_goal(parser)
    parser.add_argument("--seed", type=int, metavar="N", help="seed, in place of the run file's")
    parser.add_argument(
        "--controller", metavar="NAME", help="controller with its default parameters, in place of the run file's"
    )
    overrides(parser)


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
        type=number(float, 0.0, 1e9, "s", open_low=True),
        metavar="S",
        help=f"wall time after which an episode is ended; {MAX_SECONDS:g} by default",
    )


# -------------------------------------------------------------------------------------- many episodes


def sweep(parser: argparse.ArgumentParser) -> None:
    """--workers, --scheduler, --max-seconds and --accept-changed."""
    where = parser.add_mutually_exclusive_group()
    workers = number(int, 1, 10_000)
    where.add_argument("--workers", type=workers, metavar="N", help="number of processes; one per processor by default")
    where.add_argument("--scheduler", metavar="ADDRESS", help="run on a Dask scheduler, such as tcp://host:8786")
    max_seconds(parser)
    parser.add_argument(
        "--accept-changed",
        action="store_true",
        help="add to rows that were made with other scenes, sources, programs or on another processor",
    )


def chosen_scheduler(arguments: argparse.Namespace) -> "Scheduler":
    """Where these options let episodes run. Raises InputError, also where nothing answers at the address."""
    from mjnav.study.sweep import schedulers

    max_seconds = arguments.max_seconds or MAX_SECONDS
    if arguments.scheduler is not None:
        return schedulers.dask(arguments.scheduler, max_seconds)
    return schedulers.local(arguments.workers or len(os.sched_getaffinity(0)), max_seconds, tell)


# ------------------------------------------------------------------------------------------ --require


def require(parser: argparse.ArgumentParser, example: str) -> None:
    """--require."""
    parser.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="REQUIREMENT",
        help=f'exit with 1 where a figure does not meet this, as in "{example}"; may be repeated',
    )


def required(arguments: argparse.Namespace) -> list["Requirement"]:
    """The requirements. Raises InvalidValue."""
    if not arguments.require:
        return []
    from mjnav.study.requirements import Requirement

    return [Requirement.parse(text) for text in arguments.require]


def required_of_run(arguments: argparse.Namespace, scenario: "Scenario") -> list["Requirement"]:
    """The requirements on a run, before it starts. Raises InvalidValue, also for a figure that it does not have."""
    found = required(arguments)
    for requirement in found:
        from mjnav.metrics.own import OwnMetrics
        from mjnav.study.requirements import ALLOWED, check_figure, run_figures
        from mjnav.study.store import figure_name

        check_figure(requirement, [*run_figures(), *map(figure_name, OwnMetrics(scenario).figures)])
        if requirement.where:
            raise InvalidValue("", requirement.text, ALLOWED, file="--require")
    return found


def answers_of_run(requirements: Sequence["Requirement"], summary: Mapping[str, Any]) -> list["Answer"]:
    """What they find in the run's summary."""
    if not requirements:
        return []
    from mjnav.study.requirements import of_run
    from mjnav.study.trial import flatten

    return of_run(requirements, flatten(summary))


def exit_code(answers: Sequence["Answer"]) -> int:
    """0 where all are met; else 1, and a line for each that is not."""
    failed = [answer for answer in answers if not answer.met]
    for answer in failed:
        tell(str(answer))
    return 1 if failed else 0


def answers_document(answers: Sequence["Answer"]) -> dict[str, object]:
    """The key of --json."""
    return {"requirements": [answer.document() for answer in answers]} if answers else {}

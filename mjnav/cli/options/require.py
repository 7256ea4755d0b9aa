"""--require: figures that have to reach a value, so that a command can be a check of a user's own CI."""

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mjnav.cli.terminal.progress import tell
from mjnav.errors import InvalidValue
from mjnav.scene.spec import Scenario

if TYPE_CHECKING:
    from mjnav.study.requirements import Answer, Requirement


def configure(parser: argparse.ArgumentParser, example: str) -> None:
    """--require."""
    parser.add_argument(
        "--require",
        action="append",
        default=[],
        metavar="REQUIREMENT",
        help=f'exit with 1 where a figure does not meet this, as in "{example}"; may be repeated',
    )


def parsed(arguments: argparse.Namespace) -> list["Requirement"]:
    """The requirements. Raises InvalidValue."""
    if not arguments.require:
        return []
    from mjnav.study.requirements import Requirement

    return [Requirement.parse(text) for text in arguments.require]


def of_run(arguments: argparse.Namespace, scenario: Scenario) -> list["Requirement"]:
    """The requirements on a run, before it starts. Raises InvalidValue, also for a figure that it does not have."""
    found = parsed(arguments)
    for requirement in found:
        from mjnav.metrics.own import OwnMetrics
        from mjnav.study.requirements import ALLOWED, check_figure, run_figures
        from mjnav.study.store import figure_name

        check_figure(requirement, [*run_figures(), *map(figure_name, OwnMetrics(scenario).figures)])
        if requirement.where:
            raise InvalidValue("", requirement.text, ALLOWED, file="--require")
    return found


def answers_of_run(required: Sequence["Requirement"], summary: Mapping[str, Any]) -> list["Answer"]:
    """What they find in the run's summary."""
    if not required:
        return []
    from mjnav.study.requirements import of_run
    from mjnav.study.trial import flatten

    return of_run(required, flatten(summary))


def exit_code(answers: Sequence["Answer"]) -> int:
    """0 where all are met; else 1, and a line for each that is not."""
    failed = [answer for answer in answers if not answer.met]
    for answer in failed:
        tell(str(answer))
    return 1 if failed else 0


def documents(answers: Sequence["Answer"]) -> dict[str, object]:
    """The key of --json."""
    return {"requirements": [answer.document() for answer in answers]} if answers else {}

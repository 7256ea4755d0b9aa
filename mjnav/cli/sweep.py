"""`mjnav sweep STUDY`: every scene under every method and seed that a study file names."""

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.cli import options
from mjnav.cli.main import INTERRUPTED
from mjnav.cli.terminal import answer, interruptible, progress, tell
from mjnav.errors import InputError, MjnavError
from mjnav.loop.prepare import OUT_FOLDER
from mjnav.study.keep import check_kind
from mjnav.study.study_file import load_study, study_text

if TYPE_CHECKING:
    from mjnav.study.store import Store
    from mjnav.study.sweep.schedulers import Scheduler
    from mjnav.study.sweep.sweep import SweepSummary
    from mjnav.study.trial import Trial

MAX_CAUSES = 5  # of failures that are printed


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("study", metavar="STUDY", help="a shipped study's name, or the path of a study file")
    parser.add_argument(
        "--scene", action="append", default=[], dest="scenes", metavar="SCENE", help="in place of the study's"
    )
    parser.add_argument("--seeds", type=int, metavar="N", help="number of seeds, from the study's first on")
    options.overrides(parser)
    options.sweep(parser)
    parser.add_argument(
        "--keep-logs",
        default="none",
        metavar="none|failures|all",
        help="keep the logs of all episodes or of those that do not succeed, in the results' logs/; none by default",
    )
    parser.add_argument("-o", "--output", metavar="FOLDER", help="where results go; runs/out/<study> by default")
    parser.add_argument("--resume", action="store_true", help="run the episodes that the folder lacks")
    parser.add_argument("--retry-failed", action="store_true", help="like --resume, and run failed episodes again")
    parser.add_argument("--dry-run", action="store_true", help="check everything and print what would be run")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs the missing episodes and prints where the rows are; 1 where episodes failed."""
    check_kind(arguments.keep_logs)
    study = load_study(arguments.study)
    if arguments.seeds is not None:
        study = study.with_seeds(arguments.seeds)
    folder = Path(arguments.output) if arguments.output else OUT_FOLDER / study.name

    from mjnav.study.cells import resolve
    from mjnav.study.store import Store
    from mjnav.study.sweep.sweep import check, trials

    store = Store(folder)
    cells = resolve(study, arguments.overrides, arguments.scenes)
    wanted = trials(study, cells)
    scheduler = options.chosen_scheduler(arguments)

    def say(text: str) -> None:
        if not arguments.json:
            print(text, flush=True)

    say(f"{study.name}: {len(cells)} cells under {len(study.all_seeds)} seeds are {len(wanted)} episodes")
    if arguments.dry_run:
        check(wanted, store, resume=True, failed=not arguments.retry_failed, accept=arguments.accept_changed)
        document = {"study": study.name, "episodes": len(wanted), "cells": len(cells)}
        answer(arguments, document, lambda: say("\n".join(cell.label for cell in cells)))
        return 0
    report = run(
        arguments, scheduler, study.name, wanted, store, f"# {arguments.command_line}\n{study_text(study)}",
        resume=arguments.resume, retry_failed=arguments.retry_failed, keep_logs=arguments.keep_logs,
    )  # fmt: skip
    causes = store.causes()
    document = {"study": study.name, "folder": str(folder), **asdict(report), "causes": dict(causes)}
    answer(arguments, document, lambda: _print(folder, report, causes))
    if report.interrupted:
        tell(f"interrupted: {report.episodes - report.kept - report.run} episodes are missing, --resume runs them")
        return INTERRUPTED
    return 1 if report.failed else 0


def _print(folder: Path, report: "SweepSummary", causes: Counter[str]) -> None:
    speed = f", {report.run / report.seconds:.1f} a second" if report.run else ""
    print(f"{folder}: {report.kept + report.run} episodes, {report.run} of them in {report.seconds:.1f} s{speed}")
    for cause, count in causes.most_common(MAX_CAUSES):
        print(f"  {count} failed: {cause}")
    if report.failed:
        print("  --retry-failed runs them again")
    if report.unlogged:
        print(f"  {report.unlogged} have no log: their process died or was ended")


def run(
    arguments: argparse.Namespace, scheduler: "Scheduler", name: str, wanted: "Sequence[Trial]", store: "Store",
    text: str, **options: Any,
) -> "SweepSummary":  # fmt: skip
    """Runs what the store lacks of the trials; `text` is written beside the rows.

    `options` are those of `sweep`.
    """
    from mjnav.study.sweep.sweep import sweep

    with interruptible() as interrupted, progress(name, len(wanted), "episodes") as show:
        kept_before: int | None = None

        def begin(kept: int) -> None:
            nonlocal kept_before
            kept_before = kept
            if kept and not getattr(arguments, "json", False):
                print(f"{kept} of them are done", flush=True)

        try:
            return sweep(
                wanted, store, scheduler, text=text, accept_changed=arguments.accept_changed, stop=interrupted,
                begin=begin, progress=lambda done, row: show((kept_before or 0) + done), **options,
            )  # fmt: skip
        except MjnavError as error:
            if isinstance(error, InputError) or kept_before is None:
                raise
            how = "the same command continues" if options.get("resume") else "--resume continues"
            raise MjnavError(f"{error}\nfinished episodes are kept: {how}") from None

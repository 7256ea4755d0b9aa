"""Options of the commands that run many episodes: where these run, how long one may take, which rows are added to."""

import argparse
import os
from typing import TYPE_CHECKING

from mjnav.cli.options import scene_options
from mjnav.cli.options.common import check_whole
from mjnav.cli.terminal.progress import tell

if TYPE_CHECKING:
    from mjnav.study.sweep.schedulers import Scheduler


def configure(parser: argparse.ArgumentParser) -> None:
    """--workers, --scheduler, --max-seconds and --accept-changed."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, metavar="N", help="number of processes; one per processor by default")
    where.add_argument("--scheduler", metavar="ADDRESS", help="run on a Dask scheduler, such as tcp://host:8786")
    scene_options.max_seconds(parser)
    parser.add_argument(
        "--accept-changed",
        action="store_true",
        help="add to rows that were made with other scenes, sources, programs or on another processor",
    )


def chosen_scheduler(arguments: argparse.Namespace) -> "Scheduler":
    """Where these options let episodes run. Raises InputError, also where nothing answers at the address."""
    from mjnav.study.sweep import schedulers

    num = len(os.sched_getaffinity(0)) if arguments.workers is None else arguments.workers
    check_whole("--workers", num, 1)
    max_seconds = scene_options.checked_max_seconds(arguments)
    if arguments.scheduler is not None:
        return schedulers.dask(arguments.scheduler, max_seconds)
    return schedulers.local(num, max_seconds, tell)

"""`mjnav paper`: the figures and comparisons of Nair et al., run, judged and put on a page."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.cli import options
from mjnav.cli.main import INTERRUPTED
from mjnav.cli.sweep import run
from mjnav.cli.terminal import interruptible, progress, tell
from mjnav.errors import unknown_name
from mjnav.output_files import written

if TYPE_CHECKING:
    from mjnav.paper.episodes import PaperStudy
    from mjnav.study.store import Store
    from mjnav.study.sweep.schedulers import Scheduler

FOLDER, QUICK_FOLDER = "runs/out/paper", "runs/out/paper-quick"
QUICK_SEEDS = 1
PAGE, ROWS = "index.html", "rows"


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("--quick", action="store_true", help="all items within minutes, on too few seeds to judge by")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these items; all by default")
    parser.add_argument("--seeds", type=int, metavar="N", help="N seeds a cell in place of 200")
    parser.add_argument("--draw", action="store_true", help="run no episode: draw and judge those that are there")
    options.sweep(parser)
    parser.add_argument("-o", "--output", metavar="FOLDER", help=f"where all goes; {FOLDER} by default")


def execute(arguments: argparse.Namespace) -> int:
    """Runs what is missing, then draws and judges every item. Resumes an interrupted run."""
    from mjnav.paper import ITEMS, load
    from mjnav.paper.episodes import studies
    from mjnav.paper.page import page
    from mjnav.study.store import Store, check_results_folder

    names = list(ITEMS) if arguments.only is None else arguments.only
    for name in names:
        if name not in ITEMS:
            raise unknown_name("--only", name, ITEMS)
    seeds = arguments.seeds if arguments.seeds is not None else QUICK_SEEDS if arguments.quick else None
    folder = Path(arguments.output or (QUICK_FOLDER if arguments.quick else FOLDER))
    check_results_folder(folder)
    wanted = studies(map(load, names), seeds)
    store = Store(folder / ROWS)
    scheduler = options.chosen_scheduler(arguments)
    with interruptible() as stop:
        complete = arguments.draw or _run(wanted, store, scheduler, arguments)
        for name in names:
            if not complete or stop():
                tell("interrupted: the same command resumes, and --draw draws the episodes that are there")
                return INTERRUPTED
            _publish(name, folder, wanted, store, quick=arguments.quick, draw=arguments.draw)
    folder.mkdir(parents=True, exist_ok=True)
    with written(folder / PAGE) as file:
        file.write(page(folder, arguments.command_line).encode())
    print(f"{folder / PAGE}")
    return 0


def _run(wanted: "Sequence[PaperStudy]", store: "Store", scheduler: "Scheduler", arguments: argparse.Namespace) -> bool:
    """Runs the episodes that the store lacks; false where interrupted."""
    from mjnav.paper.episodes import trials

    every = trials(wanted)
    if not every:
        return True
    print(f"{sum(len(study.cells) for study in wanted)} cells, {len(every)} episodes", flush=True)
    report = run(arguments, scheduler, "paper", every, store, f"# {arguments.command_line}\n", resume=True)
    if report.failed:
        causes = "; ".join(f"{count} × {cause}" for cause, count in store.causes().most_common(3))
        tell(f"{report.failed} episodes failed: {causes}")
    return not report.interrupted


def _publish(
    name: str, folder: Path, wanted: "Sequence[PaperStudy]", store: "Store", *, quick: bool, draw: bool
) -> None:
    """Measures, judges and draws one item. With `draw` nothing is measured again."""
    from mjnav.loop.prepare import load_scenario
    from mjnav.paper import load
    from mjnav.paper.claims import StudyItem, judge
    from mjnav.paper.episodes import Basis, rows, table_of
    from mjnav.paper.page import publish, read

    item, command = load(name), f"mjnav paper --only {name}{' --quick' * quick}"
    if isinstance(item, StudyItem):
        data, basis = rows(store, [study for study in wanted if study.file.name in item.studies], command)
        if not data:
            others = f"; {basis.left_out} are of other scenarios or seeds" if basis.left_out else ""
            tell(f"{name}: no episode was run yet{others}")
            return
        table = table_of(data)
    elif draw:
        if read(folder / name) is None:
            tell(f"{name}: not measured yet")
        return
    else:
        scenarios = [load_scenario(scene, list(item.overrides)) for scene in item.scenes]
        with progress(name, 1.0, "items") as show:
            data = item.measure(scenarios, quick, lambda done, total: show(done / total))
        table, basis = data.rows(), Basis(command, {"scenes": "\n".join([*item.scenes, *item.overrides])})
    findings = judge(item.claims(data))
    publish(folder / name, item.picture(data), table, findings, basis)
    print(f"{name}: " + ", ".join(finding.verdict.value for finding in findings), flush=True)

"""`mjnav compare STUDY [AFTER]`: a sweep's methods in tables, or two sweeps and what changed between them."""

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.cli.options import rank, require
from mjnav.cli.terminal.progress import progress, tell
from mjnav.cli.terminal.tables import print_drawn
from mjnav.errors import InputError, InvalidValue
from mjnav.metrics.definitions import GROUPS
from mjnav.output_files import output_path, replacement
from mjnav.study import requirements as cell_figures
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES, SETS, WIN_BY
from mjnav.study.requirements import of_cells
from mjnav.study.results import find_results, kept_study
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile

if TYPE_CHECKING:
    from mjnav.study.compare.study_comparison import StudyComparison


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("study", metavar="STUDY", help="a study's name or file, or a folder with a sweep's results")
    parser.add_argument(
        "after", metavar="AFTER", nargs="?", help="a second one: what changed from STUDY to AFTER, by seed"
    )
    parser.add_argument("--reference", metavar="METHOD", help="what the others are compared with; the first by default")
    parser.add_argument(
        "--figure",
        nargs="+",
        action="extend",
        metavar="NAME",
        help=f"figures, which `mjnav list metrics` defines, or groups of them ({' '.join((*SETS, *GROUPS))}); by "
        f"default {' '.join(DEFAULT_FIGURES)}; rates always",
    )
    pools = parser.add_mutually_exclusive_group()
    pools.add_argument("--pool", action="store_true", help="all scenes in one table for each setting")
    pools.add_argument("--pool-all", action="store_true", help="all scenes and settings in one table, by layout")
    parser.add_argument("--rivals", action="store_true", help="also the win ratio of every two methods")
    parser.add_argument("--win-by", metavar="NAME", help=f"figure that decides two successes; by default {WIN_BY}")
    parser.add_argument(
        "--ratios", action="store_true", help="below costs, ratios to the reference's in place of differences"
    )
    parser.add_argument("-o", "--output", action="append", metavar="FILE", help="also to a .csv, .tex or .html file")
    rank.configure(parser)
    require.configure(parser, "hall/rkhs: success>=0.95")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the tables, and writes them to files."""
    if arguments.rank:
        rank.check(arguments)
        store, study = find_results(arguments.study)
        rank.write(store, study or _kept(store), as_json=arguments.json)
        return 0
    if arguments.after is not None:
        return _before_after(arguments)
    forms = _forms()
    outputs = [output_path("--output", given, *forms) for given in arguments.output or ()]
    store, study = find_results(arguments.study)
    study = study or _kept(store)
    required = require.parsed(arguments)
    results = _read(store, study, arguments, cell_figures.figures_for(required))
    answers = of_cells(required, cell_figures.of_study(results))
    for path in outputs:
        with replacement(path) as partial:
            partial.write_text(forms[path.suffix.lower()](path, store, study, results), encoding="utf-8")
    if arguments.json:
        from mjnav.report.comparison.tidy import document

        print(json.dumps({**document(results), **require.documents(answers)}))
        return require.exit_code(answers)
    from mjnav.report.comparison import text, worst_text
    from mjnav.study.compare.worst_seeds import run_commands, worst_seeds

    commands = run_commands(study, store.study()) if study is not None else {}
    worst = worst_seeds(store, results.study)
    print_drawn(lambda console: text.write(results, console))
    print_drawn(lambda console: worst_text.write(results, worst, commands, console))
    for path in outputs:
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return require.exit_code(answers)


def _forms() -> Mapping[str, Callable[[Path, Store, StudyFile | None, "StudyComparison"], str]]:
    """What a file of a name holds."""
    from mjnav.report.comparison.latex import latex
    from mjnav.report.comparison.tidy import csv_text

    return {
        ".csv": lambda path, store, study, results: csv_text(results),
        ".tex": lambda path, store, study, results: latex(results),
        ".html": _page,
        ".htm": _page,
    }


def _page(path: Path, store: Store, study: StudyFile | None, results: "StudyComparison") -> str:
    from mjnav.loop.provenance import revision
    from mjnav.report.comparison.html import background, html

    made = f"on {date.today().isoformat()} by mjnav {revision()}"
    return html(results, background(store, study, results, page=path, made=made))


def _kept(store: Store) -> StudyFile | None:
    """The study file that the sweep left beside its results."""
    if not store.study():
        return None
    try:
        return kept_study(store)
    except InputError as error:
        tell(f"{error}; what is missing, and labels, are not known")
        return None


def _read(
    store: Store, study: StudyFile | None, arguments: argparse.Namespace, required: Sequence[str]
) -> "StudyComparison":
    from mjnav.study.compare.study_comparison import compare_study

    with progress("compare", 100.0, "%") as show, _figure_option():
        return compare_study(
            store,
            study,
            reference=arguments.reference,
            figures=[*_figures(arguments), *required],
            pool=arguments.pool,
            pool_all=arguments.pool_all,
            win_by=arguments.win_by or WIN_BY,
            rivals=arguments.rivals,
            ratios=arguments.ratios,
            progress=lambda done, total: show(100.0 * done / total),
        )


def _before_after(arguments: argparse.Namespace) -> int:
    from mjnav.report.comparison import before_after as before_after_text
    from mjnav.report.comparison import before_after as before_after_tidy
    from mjnav.study.compare.before_after import before_after

    if arguments.reference is not None:
        raise InputError("--reference is for the methods of one study; with AFTER each method is compared with itself")
    for option in ("pool", "pool_all", "rivals", "ratios", "win_by"):
        if getattr(arguments, option):
            name = f"--{option.replace('_', '-')}"
            raise InputError(f"{name} is for the tables of one study; with AFTER each cell is compared with itself")
    outputs = [output_path("--output", given, ".csv") for given in arguments.output or ()]
    store = find_results(arguments.study)[0]
    after, study = find_results(arguments.after)
    required = require.parsed(arguments)
    with _figure_option():
        figures = [*_figures(arguments), *cell_figures.figures_for(required, after=True)]
        found = before_after(store, after, figures=figures, study=study or _kept(after))
    answers = of_cells(required, cell_figures.of_before_after(found))
    for path in outputs:
        with replacement(path) as partial:
            partial.write_text(before_after_tidy.csv_text(found), encoding="utf-8")
    if arguments.json:
        print(json.dumps({**before_after_tidy.document(found), **require.documents(answers)}))
        return require.exit_code(answers)
    print_drawn(lambda console: before_after_text.write(found, console))
    for path in outputs:
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return require.exit_code(answers)


@contextmanager
def _figure_option() -> Iterator[None]:
    """An unknown figure or reference is named by its option."""
    try:
        yield
    except InvalidValue as error:
        if error.key not in ("figure", "reference", "win_by"):
            raise
        raise InvalidValue(
            f"--{error.key.replace('_', '-')}", error.found, error.allowed, nearest=error.nearest
        ) from None


def _figures(arguments: argparse.Namespace) -> Sequence[str]:
    return DEFAULT_FIGURES if arguments.figure is None else arguments.figure

"""`mjnav compare STUDY [AFTER]`: a sweep's methods in tables, or two sweeps and what changed between them."""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import date
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjnav.cli import options
from mjnav.cli.terminal import print_drawn, print_table, tell
from mjnav.errors import InputError, InvalidValue
from mjnav.metrics.summary import GROUPS
from mjnav.output_files import output_path, replacement
from mjnav.study import requirements
from mjnav.study.cells import Labels
from mjnav.study.compare.cell_rows import DEFAULT_FIGURES, SETS, is_cost
from mjnav.study.compare.estimates import Estimate
from mjnav.study.compare.ranking import RULE, RankedSetting, rank
from mjnav.study.results import find_results, kept_study
from mjnav.study.store import Store
from mjnav.study.study_file import StudyFile

if TYPE_CHECKING:
    from rich.console import Console

    from mjnav.study.compare.study_comparison import StudyComparison


PICTURES = (".svg", ".pdf", ".png")
OUTPUTS = (".csv", ".tex", ".html", ".htm", *PICTURES)
PARETO = "pictures show success over the ratio of this cost, such as control_cost, in place of intervals of success"


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
    parser.add_argument(
        "--ratios", action="store_true", help="below costs, ratios to the reference's in place of differences"
    )
    parser.add_argument("-o", "--output", action="append", metavar="FILE", help=f"also to a file: {' '.join(OUTPUTS)}")
    parser.add_argument("--pareto", metavar="COST", help=PARETO)
    parser.add_argument(
        "--rank",
        action="store_true",
        help="in place of tables: the settings of each method by their score, and the best as a line of a study file",
    )
    options.require(parser, "hall/rkhs: success>=0.95")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


# Options that only some of a command's three forms take.
OF_METHODS = ("reference", "pool", "pool_all", "rivals", "ratios", "output", "pareto")
OF_TABLES = ("after", *OF_METHODS, "figure", "require")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the tables, and writes them to files."""
    if arguments.rank:
        _refuse(arguments, OF_TABLES, "for tables; --rank prints the settings of one study")
        return _rank(arguments)
    if arguments.after is not None:
        _refuse(arguments, OF_METHODS, "for the tables of one study; with AFTER each cell is compared with itself")
        return _before_after(arguments)
    return _methods(arguments)


def _refuse(arguments: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    """Raises InputError for an option that would do nothing."""
    for name in names:
        if getattr(arguments, name):
            option = "AFTER" if name == "after" else f"--{name.replace('_', '-')}"
            raise InputError(f"{option} is {reason}")


def _methods(arguments: argparse.Namespace) -> int:
    from mjnav.report.comparison import text
    from mjnav.report.comparison.documents import document
    from mjnav.study.compare.study_comparison import compare_study
    from mjnav.study.compare.worst_seeds import run_commands, worst_seeds

    outputs = output_paths(arguments)
    store, study = _results(arguments.study)
    required = options.required(arguments)
    results = compare_study(
        store,
        study,
        reference=arguments.reference,
        figures=[
            *(arguments.figure or DEFAULT_FIGURES),
            *requirements.figures_for(required),
            *filter(None, [arguments.pareto]),
        ],
        pool=arguments.pool,
        pool_all=arguments.pool_all,
        rivals=arguments.rivals,
        ratios=arguments.ratios,
    )

    def draw(console: "Console") -> None:
        commands = run_commands(study, store) if study is not None else {}
        text.write(results, console)
        text.write_worst(results, worst_seeds(store, results.study), commands, console)

    answers = requirements.of_cells(required, requirements.of_study(results))
    write_outputs(outputs, results, study, arguments.pareto)
    code = _print(arguments, lambda: document(results), draw, answers)
    if not arguments.json:
        for path in outputs:
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return code


def output_paths(arguments: argparse.Namespace) -> list[Path]:
    """Of `--output`. Raises InputError for a name of no form, and where `--pareto` has no cost or no picture."""
    outputs = [output_path("--output", given, *OUTPUTS) for given in arguments.output or ()]
    if arguments.pareto is not None:
        if not is_cost(arguments.pareto):
            raise InvalidValue("--pareto", arguments.pareto, "a cost: a figure of which less is better")
        if not any(path.suffix.lower() in PICTURES for path in outputs):
            raise InputError(f"--pareto is for pictures: -o FILE with {', '.join(PICTURES)}")
    return outputs


def write_outputs(
    outputs: Sequence[Path], results: "StudyComparison", study: StudyFile | None, cost: str | None = None
) -> None:
    """Each file in the form that its name ends in; pictures are over `cost` where it is given."""
    from mjnav.loop.provenance import revision
    from mjnav.report.comparison.documents import csv_text, latex
    from mjnav.report.comparison.forest import forest, pareto
    from mjnav.report.comparison.html import html

    for path in outputs:
        with replacement(path) as partial:
            match path.suffix.lower():
                case ".svg" | ".pdf" | ".png":
                    (forest(results) if cost is None else pareto(results, cost)).savefig(partial)
                case ".csv":
                    partial.write_text(csv_text(results), encoding="utf-8")
                case ".tex":
                    partial.write_text(latex(results), encoding="utf-8")
                case _:
                    made = f"Page made on {date.today().isoformat()} by mjnav {revision()}."
                    partial.write_text(html(results, study, page=path, made=made), encoding="utf-8")


def _before_after(arguments: argparse.Namespace) -> int:
    from mjnav.report.comparison import text
    from mjnav.report.comparison.documents import changes_document
    from mjnav.study.compare.before_after import before_after

    store = find_results(arguments.study)[0]
    after, study = _results(arguments.after)
    required = options.required(arguments)
    figures = [*(arguments.figure or DEFAULT_FIGURES), *requirements.figures_for(required)]
    results = before_after(store, after, figures=figures, study=study)
    answers = requirements.of_cells(required, requirements.of_before_after(results))
    return _print(
        arguments, lambda: changes_document(results), lambda console: text.write_changes(results, console), answers
    )


def _print(
    arguments: argparse.Namespace,
    document: Callable[[], Mapping[str, Any]],
    draw: Callable[["Console"], None],
    answers: list[requirements.Answer],
) -> int:
    """Prints one form of the results, and answers the requirements."""
    if arguments.json:
        print(json.dumps({**document(), **options.answers_document(answers)}))
    else:
        print_drawn(draw)
    return options.exit_code(answers)


def _results(given: str) -> tuple[Store, StudyFile | None]:
    """The results, and the study file that was named, or that the sweep left beside its results."""
    store, study = find_results(given)
    if study is None and store.study():
        try:
            study = kept_study(store)
        except InputError as error:
            tell(f"{error}; what is missing, and labels, are not known")
    return store, study


# --------------------------------------------------------------------------------------------- --rank

HEADS = ("n", "score", "success %", "collision %", "time [s]", "control cost", "values")


def _rank(arguments: argparse.Namespace) -> int:
    """Prints the settings of every method, the best first. Raises InputError."""
    store, study = _results(arguments.study)
    rankings = rank(store, study)
    if arguments.json:
        methods = [
            {
                "method": ranking.method,
                "controller": ranking.controller,
                "missing": ranking.num_missing,
                "settings": [_setting(setting) for setting in ranking.settings],
            }
            for ranking in rankings
        ]
        print(json.dumps({"schema": 1, "rule": RULE, "methods": methods}))
        return 0
    labels = Labels.of(study).methods
    for ranking in rankings:
        rows = [(labels.get(setting.label, setting.label), *_line(setting)) for setting in ranking.settings]
        print_table(rows, (ranking.shown, *HEADS), numbers=range(1, 7))
        if ranking.settings:
            print(f"best: {ranking.settings[0].toml}")
        if ranking.num_missing:
            print(f"{ranking.num_missing} episodes are missing: the order is not final")
        print()
    print(RULE)
    return 0


def _line(setting: RankedSetting) -> tuple[str, ...]:
    from mjnav.report.figure_text import Format

    of, failed = setting.figures, f" ({setting.failed} failed)" if setting.failed else ""
    costs = (Estimate(of[name].value, None, of[name].num) for name in ("time_s", "control_cost"))
    columns = [(setting.score, Format(3)), *((of[name], Format(0, 100.0)) for name in ("success", "collision"))]
    columns += [(cost, Format(1)) for cost in costs]
    return (
        f"{setting.episodes}{failed}",
        *(str(form.shown(e, e.num)) for e, form in columns),
        ", ".join(f"{key} = {value}" for key, value in setting.values.items()) or "as they stand",
    )


def _setting(setting: RankedSetting) -> dict[str, Any]:
    document = asdict(setting)
    figures, _ = document.pop("figures"), document.pop("scores")
    return document | {
        name: {**e, "value": e["value"] if isfinite(e["value"]) else None} for name, e in figures.items()
    }

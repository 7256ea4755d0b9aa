"""`mjnav compare STUDY`: a sweep's methods in tables, with intervals and differences from a reference."""

import argparse
import json
from collections.abc import Callable, Mapping
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from mjnav.cli.sweep import OUT_FOLDER
from mjnav.cli.terminal import streams
from mjnav.cli.terminal.progress import progress, tell
from mjnav.errors import InputError, InvalidValue, unknown_name
from mjnav.output_files import output_path, replacement
from mjnav.study.compare.compare import DEFAULT_FIGURES
from mjnav.study.store.store import STUDY_FILE, Store
from mjnav.study.study_file import StudyFile, load_study, studies

if TYPE_CHECKING:
    from mjnav.study.compare.study_comparison import StudyComparison

PIPE_WIDTH = 10_000  # [characters] where there is no terminal: no line is broken


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("study", metavar="STUDY", help="a study's name or file, or a folder with a sweep's results")
    parser.add_argument("--reference", metavar="METHOD", help="what the others are compared with; the first by default")
    parser.add_argument(
        "--figure",
        nargs="+",
        action="extend",
        metavar="NAME",
        help=f"by default {' '.join(DEFAULT_FIGURES)}; rates always",
    )
    parser.add_argument("-o", "--output", action="append", metavar="FILE", help="also to a .csv, .tex or .html file")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the tables, and writes them to files."""
    forms = _forms()
    outputs = [output_path("--output", given, *forms) for given in arguments.output or ()]
    folder, study = _find(arguments.study)
    store = Store(folder)
    if not store.has_rows():
        raise InputError(
            f"{folder}: no results of a sweep" + f"; mjnav sweep {arguments.study} makes them" * bool(study)
        )
    study = study or _kept(store)
    results = _read(store, study, arguments)
    for path in outputs:
        with replacement(path) as partial:
            partial.write_text(forms[path.suffix.lower()](path, store, study, results), encoding="utf-8")
    if arguments.json:
        from mjnav.report.comparison.tidy import document

        print(json.dumps(document(results)))
        return 0
    _print(results)
    for path in outputs:
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return 0


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
    from mjnav.loop.provenance.run_info import revision
    from mjnav.report.comparison.background import background
    from mjnav.report.comparison.html import html

    made = f"on {date.today().isoformat()} by mjnav {revision()}"
    return html(results, background(store, study, results, page=path, made=made))


def _find(given: str) -> tuple[Path, StudyFile | None]:
    """The folder of the results, and the study file where one was named."""
    if given.endswith(".toml") or given in studies():
        study = load_study(given)
        return OUT_FOLDER / study.name, study
    for folder in (Path(given), OUT_FOLDER / given):
        if folder.is_dir():
            return folder, None
    if "/" in given:
        raise InputError(f"{given}: no such folder")
    there = [folder.name for folder in OUT_FOLDER.glob("*") if folder.is_dir()]
    raise unknown_name("study", given, {*studies(), *there})


def _kept(store: Store) -> StudyFile | None:
    """The study file that the sweep left beside its results."""
    if not store.study():
        return None
    try:
        return load_study(store.folder / STUDY_FILE)
    except InputError as error:
        tell(f"{error}; what is missing is not known")
        return None


def _read(store: Store, study: StudyFile | None, arguments: argparse.Namespace) -> "StudyComparison":
    from mjnav.study.compare.study_comparison import compare_study

    figures = DEFAULT_FIGURES if arguments.figure is None else arguments.figure
    with progress("compare", 100.0, "%") as show:
        try:
            return compare_study(
                store,
                study,
                reference=arguments.reference,
                figures=figures,
                progress=lambda done, total: show(100.0 * done / total),
            )
        except InvalidValue as error:
            raise InvalidValue(f"--{error.key}", error.found, error.allowed, nearest=error.nearest) from None


def _print(results: "StudyComparison") -> None:
    from mjnav.report.comparison.text import write

    console = streams.console(width=PIPE_WIDTH)
    with console.capture() as captured:  # rich itself would end the process where the reader has gone
        write(results, console)
    streams.show("".join(f"{line.rstrip()}\n" for line in captured.get().splitlines()))

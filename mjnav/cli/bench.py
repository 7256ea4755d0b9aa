"""`mjnav bench [METHOD ...]`: methods beside the reference rows of all shipped ones, in suites that nobody tunes on."""

import argparse
import json
from typing import TYPE_CHECKING

from mjnav.cli import options
from mjnav.cli.compare import OUTPUTS, PARETO, output_paths, write_outputs
from mjnav.cli.main import INTERRUPTED
from mjnav.cli.sweep import run
from mjnav.cli.terminal import print_drawn, print_table, tell
from mjnav.errors import InputError, InvalidValue, unknown_name
from mjnav.loop.prepare import OUT_FOLDER
from mjnav.output_files import replacement
from mjnav.scene.overrides import overrides_of
from mjnav.scene.spec import Control
from mjnav.settings import keys
from mjnav.study.compare.cell_rows import is_cost
from mjnav.study.compare.study_comparison import StudyComparison
from mjnav.study.study_file import MethodEntry

if TYPE_CHECKING:
    from mjnav.study.bench import Bench

QUICK = 0.1  # of the layouts
OF_EPISODES = ("quick", "share", "workers", "scheduler", "max_seconds", "accept_changed")
SHARE = options.number(float, 0.0, 1.0, open_low=True)


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument(
        "methods",
        metavar="METHOD",
        nargs="*",
        help="a shipped name, file.py:Class or module:Class; none: the reference",
    )
    parser.add_argument("--suites", metavar="FILE", help="suites of your own; their rows lie beside it as .parquet")
    parser.add_argument("--suite", action="append", default=[], metavar="NAME", help="one of the suites; repeatable")
    some = parser.add_mutually_exclusive_group()
    some.add_argument("--quick", action="store_true", help="a tenth of the layouts")
    some.add_argument("--share", type=SHARE, metavar="X", help="another share of the layouts")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="KEY=VALUE",
        help="a parameter of the methods, as weight=3; repeatable",
    )
    parser.add_argument("--reference", action="store_true", help="run all methods of the file, and make its rows anew")
    options.sweep(parser)
    parser.add_argument("--folder", metavar="FOLDER", help="where rows go; runs/out/bench by default")
    parser.add_argument("-o", "--output", action="append", metavar="FILE", help=f"also to a file: {' '.join(OUTPUTS)}")
    parser.add_argument("--pareto", metavar="COST", help=PARETO)
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs what is missing, prints the table over all suites, and writes the files."""
    from mjnav.report.comparison.documents import document
    from mjnav.study.bench import BENCH, FIGURES, Bench, Reference, comparison, share_of, weakest
    from mjnav.study.store import Store

    outputs = output_paths(arguments)
    if arguments.pareto not in (None, *FIGURES):
        raise unknown_name("--pareto", arguments.pareto, [figure for figure in FIGURES if is_cost(figure)])
    options.check_needs("--set", "METHOD", given=bool(arguments.overrides), met=bool(arguments.methods))
    for name in OF_EPISODES:
        given, met = bool(getattr(arguments, name)), bool(arguments.methods or arguments.reference)
        options.check_needs(f"--{name.replace('_', '-')}", "METHOD or --reference", given=given, met=met)
    share = QUICK if arguments.quick else arguments.share or 1.0
    if arguments.reference and (arguments.methods or arguments.suite):
        raise InputError("--reference runs all methods of the file of suites in all of them")
    scheduler = options.chosen_scheduler(arguments)
    bench = Bench.load(arguments.suites).only(arguments.suite)
    reference = Reference.load(bench.rows)
    store = Store(arguments.folder or OUT_FOLDER / BENCH)
    methods = list(bench.methods) if arguments.reference else _entries(bench, arguments)
    code = 0
    if methods:
        seeds = {}
        for suite in bench.suites:
            study = suite.study(methods)
            own = arguments.reference or reference.differs(suite) is not None
            seeds[suite.name] = share_of(study.all_seeds if own else reference.seeds(study.name), share)
        wanted = bench.trials(methods, seeds)
        report = run(arguments, scheduler, BENCH, wanted, store, f"# {arguments.command_line}\n", resume=True)
        code = INTERRUPTED if report.interrupted else 1 if report.failed else 0
        if code == INTERRUPTED and arguments.reference:
            return code
    if arguments.reference:
        reference, methods = Reference.of(store, bench), []
        with replacement(bench.rows) as partial:
            partial.write_bytes(reference.content())
        tell(f"{bench.rows}: {len(reference.table)} rows")
    for suite in bench.suites:
        if reason := reference.differs(suite):
            tell(f"suite {suite.name}: {reason}")
    results = comparison(bench, reference, store, methods)
    if not results.tables:
        raise InputError("there are no rows: name a method, or make the reference with --reference")
    write_outputs(outputs, results, None, arguments.pareto)
    if arguments.json:
        print(json.dumps(document(results)))
    else:
        _print(results)
        for method in methods:
            for suite, episode, command in weakest(bench, store, method):
                print(f"{method.shown} in {suite}, worst: {episode}\n    {command}")
        for path in outputs:
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return code


def _entries(bench: "Bench", arguments: argparse.Namespace) -> list[MethodEntry]:
    """The methods of the command line. Raises InvalidValue for a value that is no parameter of a controller."""
    values = {}
    for given in overrides_of(arguments.overrides):
        key = given.key.removeprefix("control.")
        if "." in key or key in keys(Control):
            raise InvalidValue("--set", given.key, "a parameter of the method: the suites say all else")
        values[key] = given.value
    return [bench.entry(name, values) for name in dict.fromkeys(arguments.methods)]


def _print(results: StudyComparison) -> None:
    """The first table whole, of the others the rates of success, then what figures mean."""
    from mjnav.report.comparison import text
    from mjnav.report.comparison.shown import about, meaning, shown_tables, warnings

    first, *suites = results.tables
    print(f"{first.title}; {about(first)[0]}; all differ from {first.reference_label}")
    print_drawn(lambda console: text.write_table(next(shown_tables(first, ratios=True)), console))
    if suites:
        rates = [{row.label: f"{100.0 * row.figures['success'].value:.0f}" for row in one.rows} for one in suites]
        heads = ["success %", *(f"{one.scene} ({one.rows[0].num})" for one in suites)]
        rows = [[row.label, *(of.get(row.label, "-") for of in rates)] for row in first.rows]
        print()
        print_table(rows, heads, numbers=range(1, len(heads)))
    print()
    for sentence in (*meaning(results), *warnings(results)):
        print(sentence)

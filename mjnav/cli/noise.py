"""`mjnav noise fit FILE.csv`: laws fitted to recorded errors, as tables of a run file."""

import argparse
import json
import os
from math import isfinite

import numpy as np

from mjnav.cli.terminal import print_table
from mjnav.errors import InvalidValue
from mjnav.noise.fit import Fit, fits
from mjnav.output_files import output_path, written
from mjnav.scene.samples import read_column


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("action", choices=("fit",), help="fit laws to errors")
    parser.add_argument("file", metavar="FILE.csv", help="errors, measured minus true, a column with its name on top")
    parser.add_argument("--column", metavar="NAME", help="of the errors, where the file has several")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")
    parser.add_argument("-o", "--output", metavar="OUT.png", help="a picture: quantiles of the errors and of the laws")


def execute(arguments: argparse.Namespace) -> int:
    """Fits, prints the laws and the table of the best."""
    picture = None if arguments.output is None else output_path("--output", arguments.output, ".png")
    column, values = read_column(arguments.file, arguments.column)
    errors = np.array(values)
    try:
        found = fits(errors)
    except InvalidValue as error:
        raise InvalidValue(column, error.found, error.allowed, file=arguments.file) from None
    if picture is not None:
        from mjnav.report.figures import quantile_figure

        with written(picture) as file:
            quantile_figure(errors, found, column).savefig(file, format="png")
    tables = {fit.name: table(fit, arguments.file, column) for fit in found}
    if arguments.json:
        laws = {
            fit.name: {**fit.arguments, "score": fit.score if isfinite(fit.score) else None, "distance": fit.distance}
            for fit in found
        }
        print(json.dumps({"schema": 1, "column": column, "errors": len(errors), "laws": laws, "tables": tables}))
        return 0
    print(f"{column}: {len(errors)} errors, mean {errors.mean():.4g}, std {errors.std():.4g}")
    rows = [[fit.name, f"{fit.score:.3f}", f"{fit.distance:.3f}", f"{fit.law.std:.4g}"] for fit in found]
    print_table(rows, ["law", "log-density left out", "largest |F_n - F|", "std"], numbers=(1, 2, 3))
    print(f"\nfor a run file, with the channel's name in place of CHANNEL:\n\n{tables[found[0].name]}", end="")
    return 0


def table(fit: Fit, file: str, column: str) -> str:
    """A law as a table of a run file."""
    lines = ["[noise.CHANNEL]", f'distribution = "{fit.name}"']
    for key, value in fit.arguments.items():
        numbers = ", ".join(f"{v:.6g}" for v in value) if isinstance(value, tuple) else ""
        lines.append(f"{key} = [{numbers}]" if isinstance(value, tuple) else f"{key} = {value:.6g}")
    if not fit.arguments:
        lines.append(f"samples = {{ file = {json.dumps(os.fspath(file))}, column = {json.dumps(column)} }}")
    return "\n".join(lines) + "\n"

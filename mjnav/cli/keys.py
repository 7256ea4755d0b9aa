"""`mjnav keys [PREFIX]`: the keys of run files and study files, with type, unit, range, default and meaning."""

import argparse
from dataclasses import asdict
from math import isfinite
from typing import Any

from mjnav.cli.options import check_needs
from mjnav.cli.terminal import answer, print_table
from mjnav.scene.toml import value_text
from mjnav.settings.reference import KeyReference
from mjnav.study.key_reference import keys_below, run_keys, study_keys


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument(
        "prefix",
        metavar="PREFIX",
        nargs="?",
        default="",
        help="a key, its beginning, or one of its parts: robot, radius",
    )
    parser.add_argument(
        "--controller",
        metavar="NAME",
        help="of [control], the parameters of this controller; of all shipped ones by default",
    )
    parser.add_argument("--study", action="store_true", help="the keys of study files in place of run files")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints a row for each key."""
    check_needs(
        "--controller", "run files: leave out --study", given=arguments.controller is not None, met=not arguments.study
    )
    rows = study_keys() if arguments.study else run_keys(arguments.controller)
    if arguments.prefix:
        rows = keys_below(rows, arguments.prefix)
    heads = ("key", "type", "unit", "allowed", "default", "meaning")
    texts = [(r.key, r.type, r.unit, r.allowed, _default(r), _meaning(r)) for r in rows]
    answer(arguments, {"keys": [_document(row) for row in rows]}, lambda: print_table(texts, heads))
    return 0


def _default(row: KeyReference) -> str:
    if row.required:
        return "required"
    return "" if row.default is None else value_text(row.default)


def _meaning(row: KeyReference) -> str:
    return f"{row.description} ({row.where})" if row.where else row.description


def _document(row: KeyReference) -> dict[str, Any]:
    """The row as JSON, which has no infinite number: "inf" in its place."""
    document = asdict(row)
    if isinstance(row.default, float) and not isfinite(row.default):
        document["default"] = str(row.default)
    return document

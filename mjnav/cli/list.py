"""`mjnav list [KIND]`: the names that run files and options may use."""

import argparse
from collections.abc import Mapping

from mjnav.cli.terminal import answer, print_table
from mjnav.study.key_reference import KINDS, catalogue, names


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    every = ", ".join(kind.replace(" ", "-") for kind in KINDS)
    parser.add_argument("kind", metavar="KIND", nargs="?", help=f"only one kind of names: {every}")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the names, each with a sentence."""
    if arguments.kind is None:
        listed = catalogue()
    else:
        listed = {arguments.kind.replace("-", " ").replace("_", " "): names(arguments.kind)}
    document = {kind.replace(" ", "_"): dict(entries) for kind, entries in listed.items()}
    answer(arguments, document, lambda: _print(listed))
    return 0


def _print(listed: Mapping[str, Mapping[str, str]]) -> None:
    for kind, entries in listed.items():
        print(kind)
        print_table([(f"  {name}", text) for name, text in entries.items()])

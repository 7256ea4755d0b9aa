"""`mjnav schema`: JSON Schemas of run files and study files, for editors."""

import argparse
import json

from mjnav.study.key_reference import run_schema, study_schema


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("kind", choices=("run", "study"), help="the kind of file")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the schema."""
    schema = run_schema() if arguments.kind == "run" else study_schema()
    print(json.dumps(schema, indent=1, ensure_ascii=False, allow_nan=False))
    return 0

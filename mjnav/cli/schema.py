"""`mjnav schema`: JSON Schemas of run files and study files, for editors."""

import argparse
import json

from mjnav.output_files import output_path, written
from mjnav.study.key_reference import run_schema, study_schema


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("kind", choices=("run", "study"), help="the kind of file")
    parser.add_argument("-o", "--output", metavar="FILE", help="write it there; default: standard output")


def execute(arguments: argparse.Namespace) -> int:
    """Prints or writes the schema."""
    schema = run_schema() if arguments.kind == "run" else study_schema()
    text = json.dumps(schema, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    if arguments.output is None:
        print(text, end="")
        return 0
    with written(output_path("--output", arguments.output, ".json")) as file:
        file.write(text.encode())
    return 0

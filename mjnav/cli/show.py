"""`mjnav show SCENE`: a shipped run file or study file as it is, or a scene as a run has it."""

import argparse
import os

from mjnav.cli.options import overrides
from mjnav.errors import InputError, unknown_name
from mjnav.output_files import new_path, written
from mjnav.scene import data_folder, dumps, load, names
from mjnav.study.study_file import FOLDER, studies


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument(
        "name", metavar="SCENE", help="the name of a shipped scene or study; with --seed or --set also a run file"
    )
    parser.add_argument(
        "--seed",
        type=int,
        metavar="N",
        help="the scene as a run with this seed has it, or with values of --set: with all defaults and draws made",
    )
    overrides(parser)
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write it to a new file; default: standard output")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the file, or copies it."""
    runs = data_folder("runs")
    if arguments.seed is not None or arguments.overrides:
        return _write(dumps(load(arguments.name, arguments.overrides, seed=arguments.seed)), arguments.output)
    if arguments.name in names():
        path = runs / f"{arguments.name}.toml"
    elif arguments.name in studies():
        path = runs / FOLDER / f"{arguments.name}.toml"
    elif os.path.isfile(arguments.name):
        raise InputError(f"{arguments.name}: a run file is shown with --seed or --set, as a run has it")
    else:
        raise unknown_name("SCENE", arguments.name, (*names(), *studies()))
    return _write(path.read_text(encoding="utf-8"), arguments.output)


def _write(text: str, output: str | None) -> int:
    if output is None:
        print(text, end="")
        return 0
    with written(new_path("--output", output, ".toml")) as file:
        file.write(text.encode())
    return 0

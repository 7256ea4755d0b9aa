"""`mjnav show SCENE`: a shipped run file or study file as it is, to start one's own from."""

import argparse

from mjnav.errors import unknown_name
from mjnav.output_files import new_path, written
from mjnav.scenarios import data_folder, names
from mjnav.study.study_file import FOLDER, studies


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("name", metavar="SCENE", help="the name of a shipped scene or study")
    parser.add_argument("-o", "--output", metavar="FILE.toml", help="write it to a new file; default: standard output")


def execute(arguments: argparse.Namespace) -> int:
    """Prints the file, or copies it."""
    runs = data_folder("runs")
    if arguments.name in names():
        path = runs / f"{arguments.name}.toml"
    elif arguments.name in studies():
        path = runs / FOLDER / f"{arguments.name}.toml"
    else:
        raise unknown_name("SCENE", arguments.name, (*names(), *studies()))
    text = path.read_text(encoding="utf-8")
    if arguments.output is None:
        print(text, end="")
        return 0
    with written(new_path("--output", arguments.output, ".toml")) as file:
        file.write(text.encode())
    return 0

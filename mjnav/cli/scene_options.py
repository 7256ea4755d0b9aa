"""The scene that a command runs: its name or path, and what takes the place of what stands in it."""

import argparse


def configure(parser: argparse.ArgumentParser) -> None:
    """SCENE, --seed, --controller and --set."""
    scene(parser)
    parser.add_argument("--seed", type=int, metavar="N", help="in place of the run file's seed")
    parser.add_argument("--controller", metavar="NAME", help="in place of the run file's, with its default parameters")
    overrides(parser)


def scene(parser: argparse.ArgumentParser) -> None:
    """SCENE."""
    parser.add_argument("scene", metavar="SCENE", help="a shipped scene's name, or the path of a run file")


def overrides(parser: argparse.ArgumentParser) -> None:
    """--set."""
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE", help="any key: people.0.radius=0.4"
    )

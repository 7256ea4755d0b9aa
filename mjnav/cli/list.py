"""`mjnav list`: the names that run files and options may use."""

import argparse
import json

from mjnav import control, noise, scenarios
from mjnav.scenarios.spec import BEHAVIOURS
from mjnav.study.study_file import studies


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Prints scenes, studies, controllers, noise profiles and behaviours."""
    listed = {
        "scenes": dict(scenarios.describe()),
        "studies": studies(),
        "controllers": control.describe(),
        "noise profiles": dict.fromkeys(noise.profile_names(), ""),
        "behaviours": {name: _first_line(kind) for name, kind in sorted(BEHAVIOURS.items())},
    }
    if arguments.json:
        print(json.dumps({"schema": 1, **{kind.replace(" ", "_"): names for kind, names in listed.items()}}))
        return 0
    for kind, names in listed.items():
        print(kind)
        width = max(map(len, names))
        for name, text in names.items():
            print(f"  {name:{width}}  {text}".rstrip())
    return 0


def _first_line(kind: type) -> str:
    return (kind.__doc__ or "").strip().splitlines()[0]

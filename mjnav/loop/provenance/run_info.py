"""What a log says about the program that wrote it."""

import os
import platform
import shlex
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from mjnav.loop.provenance.facts import package_version, provenance
from mjnav.printable import printable
from mjnav.scenarios.plugged import plugins_of
from mjnav.scenarios.spec import Scenario


def run_info(scenario: Scenario, seed: int, parts_hash: str) -> dict[str, str]:
    """The metadata `mjnav/run`: seed, scene, controller, git revision, command line, and all that decides the bits."""
    return {
        "scene": scenario.name,
        "controller": scenario.control.method,
        "seed": str(seed),
        "engine": scenario.physics.engine,
        **({} if scenario.prediction is None else {"prediction": scenario.prediction.name}),
        "parts_hash": parts_hash,
        "git_revision": _git_revision(),
        "argv": printable(shlex.join(sys.argv)),
        "machine": platform.machine(),
        "processor": _processor(),
        "version.mcap": package_version("mcap"),
        **provenance(scenario.control.method, plugins_of(scenario).values()),
    }


@cache
def revision() -> str:
    """The version of mjnav, and the git revision where it runs from a source tree."""
    return " ".join(part for part in (package_version("mjnav"), _git_revision()) if part)


@cache
def _processor() -> str:
    """The processor's product name."""
    with suppress(OSError), open("/proc/cpuinfo") as file:
        for line in file:
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor()


@cache
def _git_revision() -> str:
    """The source tree's commit, "+changes" where it has some; empty for an installed package."""
    root = Path(__file__).parents[3]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", os.fspath(root), "describe", "--always", "--abbrev=40", "--dirty=+changes"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""

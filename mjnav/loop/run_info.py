"""What a log says about the program that wrote it."""

import os
import platform
import shlex
import subprocess
import sys
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from mjnav.scenarios.spec import Scenario

PACKAGES = ("mjnav", "mujoco", "numpy", "numba", "scipy", "filterpy", "mcap")


def run_info(scenario: Scenario, seed: int, parts_hash: str) -> dict[str, str]:
    """The metadata `mjnav/run`: seed, scene, controller, versions, git revision, command line."""
    return {
        "scene": scenario.name,
        "controller": scenario.control.method,
        "seed": str(seed),
        "engine": scenario.physics.engine,
        "parts_hash": parts_hash,
        "git_revision": _git_revision(),
        "argv": shlex.join(sys.argv),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "processor": _processor(),
        "libc": " ".join(platform.libc_ver()),
        **{f"version.{package}": _version(package) for package in PACKAGES},
    }


@cache
def revision() -> str:
    """The version of mjnav, and the git revision where it runs from a source tree."""
    return " ".join(part for part in (_version("mjnav"), _git_revision()) if part)


@cache
def _processor() -> str:
    """Its name: NumPy and numba compute with whatever instructions it has."""
    with suppress(OSError), open("/proc/cpuinfo") as file:
        for line in file:
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


@cache
def _git_revision() -> str:
    """The source tree's commit, "+changes" where it has some; empty for an installed package."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", os.fspath(root), "describe", "--always", "--abbrev=40", "--dirty=+changes"]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""

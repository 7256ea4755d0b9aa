"""Commands that make pictures and films while the site is built, once for each state of mjnav's sources."""

import hashlib
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
READ = (".py", ".toml", ".xml", ".js", ".css", ".html")  # files that decide what the commands make


def make(commands: str, folder: Path) -> None:
    """Runs the commands with bash in `folder`, which appears whole or not at all.

    Raises RuntimeError with the output of commands that fail.
    """
    work = folder.with_name(f"{folder.name}.part")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    installed = str(Path(sys.executable).parent)  # where `mjnav` is, unless somebody has another one for the pictures
    path = ":".join([os.environ.get("MJNAV_PROGRAMS", installed), installed, os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-e", "-c", commands], cwd=work, env={**os.environ, "PATH": path}, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode} of\n{commands}\n{done.stdout}{done.stderr}")
    for log in work.rglob("*.mcap"):
        log.unlink()  # large, and not shown
    shutil.rmtree(folder, ignore_errors=True)
    work.rename(folder)


def digest(text: str) -> str:
    """Of a text and of mjnav's sources, scenes and models."""
    return hashlib.sha256(f"{text}{_sources()}".encode()).hexdigest()[:12]


@cache
def _sources() -> str:
    files = [file for folder in ("mjnav", "models", "runs") for file in sorted((ROOT / folder).rglob("*"))]
    read = [file for file in files if file.suffix in READ and ROOT / "runs" / "out" not in file.parents]
    return hashlib.sha256(b"".join(file.read_bytes() for file in read)).hexdigest()

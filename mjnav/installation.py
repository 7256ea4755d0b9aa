"""How this mjnav was installed, and so the command that adds an optional package to it.

Installers leave a note of themselves beside a package's metadata (INSTALLER), and of where it came from unless that was
a registry (direct_url.json, PEP 610).
"""

import json
import os
import shlex
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit


def command_for(package: str, extra: str) -> str:
    """The command that installs what the extra of mjnav brings, in the environment of this process."""
    try:
        return installing(distribution("mjnav"), package, extra)
    except PackageNotFoundError:  # run from a folder of sources alone
        return f"{_pip(None)} {package}"


def installing(found: Distribution, package: str, extra: str, prefix: str = sys.prefix) -> str:
    """The same for a distribution of mjnav that was found in the environment at `prefix`.

    In a checkout that uv manages, uv adds the extra; from a registry, the installer does; of a wheel or another
    checkout, the extra's own requirements are installed, which needs neither of them again.
    """
    origin = _origin(found)
    checkout = _checkout(origin)
    by_uv = _is_uv(found)
    if by_uv and checkout is not None and Path(prefix).parent == checkout:
        here = "" if Path.cwd() == checkout else f" --project {shlex.quote(str(checkout))}"
        return f"uv sync{here} --inexact --extra {extra}"
    wanted = [f"mjnav[{extra}]"] if origin is None else list(_requirements(found, extra)) or [package]
    pip = _uv_pip(prefix) if by_uv else _pip(prefix)
    return f"{pip} {' '.join(map(shlex.quote, wanted))}"


def _origin(found: Distribution) -> Any:
    """What direct_url.json says; None where it came from a registry."""
    text = found.read_text("direct_url.json")
    try:
        return None if text is None else json.loads(text)
    except ValueError:
        return {}


def _checkout(origin: Any) -> Path | None:
    """The folder of sources that an editable installation uses."""
    if not isinstance(origin, dict) or not (origin.get("dir_info") or {}).get("editable"):
        return None
    return Path(unquote(urlsplit(str(origin.get("url"))).path))


def _is_uv(found: Distribution) -> bool:
    return (found.read_text("INSTALLER") or "").strip() == "uv"


def _requirements(found: Distribution, extra: str) -> Iterator[str]:
    """What the extra adds, as "gymnasium<2,>=1.1"."""
    for requirement in found.requires or ():
        wanted, _, marker = requirement.partition(";")
        if marker.replace('"', "'").strip() == f"extra == '{extra}'":
            yield wanted.strip()


def _uv_pip(prefix: str) -> str:
    active = os.environ.get("VIRTUAL_ENV") == prefix
    return "uv pip install" if active else f"uv pip install --python {shlex.quote(prefix)}"


def _pip(prefix: str | None) -> str:
    """pip where it is this environment's, else this environment's Python with pip."""
    pip = shutil.which("pip")
    if prefix is None or (pip is not None and Path(pip).parent == Path(prefix) / "bin"):
        return "pip install"
    return f"{shlex.quote(str(Path(prefix) / 'bin' / 'python'))} -m pip install"

"""A missing optional package is answered with a command that works where this mjnav is installed."""

from importlib.metadata import PathDistribution, distribution
from pathlib import Path

import pytest

from mjnav import installation
from mjnav.errors import missing_extra
from mjnav.installation import installing

METADATA = """Metadata-Version: 2.4
Name: mjnav
Version: 0.1.0
Requires-Dist: numpy<3,>=2.1
Provides-Extra: gym
Requires-Dist: gymnasium<2,>=1.1; extra == 'gym'
"""
WHEEL = '{"url": "file:///tmp/mjnav-0.1.0-py3-none-any.whl", "archive_info": {}}'
EDITABLE = '{"url": "file:///home/u/my%20work/mjnav", "dir_info": {"editable": true}}'
CHECKOUT = "/home/u/my work/mjnav"


def installed(folder: Path, installer: str, origin: str | None) -> PathDistribution:
    folder.mkdir()
    (folder / "METADATA").write_text(METADATA)
    (folder / "INSTALLER").write_text(f"{installer}\n")
    if origin is not None:
        (folder / "direct_url.json").write_text(origin)
    return PathDistribution(folder)


@pytest.mark.parametrize(
    ("installer", "origin", "prefix", "command"),
    [
        ("pip", None, "/opt/a", "pip install 'mjnav[gym]'"),
        ("pip", WHEEL, "/opt/a", "pip install 'gymnasium<2,>=1.1'"),
        ("pip", EDITABLE, "/opt/a", "pip install 'gymnasium<2,>=1.1'"),
        ("pip", WHEEL, "/opt/b", "/opt/b/bin/python -m pip install 'gymnasium<2,>=1.1'"),
        ("uv", None, "/opt/a", "uv pip install 'mjnav[gym]'"),
        ("uv", WHEEL, "/opt/b", "uv pip install --python /opt/b 'gymnasium<2,>=1.1'"),
        ("uv", EDITABLE, f"{CHECKOUT}/.venv", f"uv sync --project '{CHECKOUT}' --inexact --extra gym"),
        ("uv", EDITABLE, "/opt/a", "uv pip install 'gymnasium<2,>=1.1'"),
    ],
)
def test_the_command_fits_the_installation(installer, origin, prefix, command, tmp_path, monkeypatch):
    monkeypatch.setattr(installation.shutil, "which", lambda name: f"/opt/a/bin/{name}")  # /opt/a is active
    monkeypatch.setenv("VIRTUAL_ENV", "/opt/a")
    found = installed(tmp_path / "mjnav-0.1.0.dist-info", installer, origin)
    assert installing(found, "gymnasium", "gym", prefix) == command


def test_every_extra_of_this_environment_has_a_command(monkeypatch, tmp_path):
    extras = set(distribution("mjnav").metadata.get_all("Provides-Extra") or ())
    assert {"gym", "live", "pandas", "ros2", "sweep", "video"} <= extras
    monkeypatch.chdir(tmp_path)
    for extra in extras:
        text = str(missing_extra("a package", extra))
        assert text.startswith("a package is not installed: ")
        assert " install " in text or text.endswith(f" --extra {extra}")


def test_the_requirements_of_an_extra_are_read_from_real_metadata():
    assert any(wanted.startswith("pyarrow") for wanted in installation._requirements(distribution("mjnav"), "sweep"))

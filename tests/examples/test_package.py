"""The example package, installed: mjnav finds its classes by name, and refuses a name of two packages."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "examples" / "package"
PROJECT = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
QUICK = ("--set", "physics.engine=kinematic", "--set", "time_limit=1")


def install(folder, name, version, entry_points):
    """What an installer writes of a wheel's metadata."""
    metadata = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n")
    groups = (f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in own.items()) for group, own in entry_points.items())
    (metadata / "entry_points.txt").write_text("\n".join(groups))


@pytest.fixture
def mjnav(tmp_path):
    """Runs mjnav in an empty folder, with the example package installed."""
    site = tmp_path / "site"
    shutil.copytree(PACKAGE / "lab_navigation", site / "lab_navigation", ignore=shutil.ignore_patterns("__pycache__"))
    install(site, PROJECT["name"], PROJECT["version"], PROJECT["entry-points"])
    folder = tmp_path / "folder"
    folder.mkdir()

    def call(*words, others=()):
        path = os.pathsep.join(map(str, (site, *others)))
        command = [Path(sys.executable).with_name("mjnav"), *words]
        environment = {**os.environ, "PYTHONPATH": path}
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)

    return call


def test_classes_of_an_installed_package_are_named_by_their_names(mjnav):
    person = ("--set", "people.0.behaviour=hesitant", "--set", "people.0.speed=1.5")
    metrics = ("--set", 'metrics=["standing"]', "--require", "metrics_standing_s<1")
    said = mjnav("run", "crossing1", "--controller", "careful", *person, *metrics, *QUICK, "--json", "--log", "a.mcap")
    assert said.returncode == 0, said.stderr
    summary = json.loads(said.stdout)
    assert summary["controller"] == "careful"
    assert 0.0 < summary["metrics"]["standing_s"] < 1.0
    inspected = json.loads(mjnav("inspect", "a.mcap", "--json").stdout)
    assert set(json.loads(inspected["run"]["sources.controller"])) == {
        f"lab_navigation/{name}.py" for name in ("__init__", "control", "people", "figures")
    }


def test_a_name_that_two_packages_register_is_refused_with_both(mjnav, tmp_path):
    other = tmp_path / "other"
    install(other, "other-lab", "2.0", {"mjnav.controllers": {"careful": "other_lab:Careful"}})
    said = mjnav("run", "crossing1", "--controller", "careful", *QUICK, "--no-log", others=[other])
    assert (said.returncode, said.stdout) == (2, "")
    assert said.stderr.startswith(
        "mjnav: --controller: control.method: found 'careful'; allowed: a controller that one"
    )
    assert "lab-navigation 0.1.0 and other-lab 2.0" in said.stderr
    place = PROJECT["entry-points"]["mjnav.controllers"]["careful"]
    assert mjnav("run", "crossing1", "--controller", place, *QUICK, "--no-log", others=[other]).returncode == 0

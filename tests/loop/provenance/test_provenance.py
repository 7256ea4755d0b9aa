"""What decides an episode's bits is recorded, with the files behind a controller of one's own; what differs is told."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from mjnav.loop.provenance import FACTS, changes, digest, mjnav_sources, plugin_sources, provenance
from mjnav.settings.plugins import ControllerPlugin

HERE = provenance("rkhs")


def changed(**facts: str | None) -> dict[str, str | None]:
    return {**HERE, **{fact.replace("_", "."): value for fact, value in facts.items()}}


def test_every_fact_is_known_here():
    assert list(HERE) != []
    assert set(HERE) == set(FACTS)
    assert all(HERE[fact] for fact in FACTS if fact != "sources.controller")
    assert HERE["version.numpy"] == np.__version__
    assert "unknown" not in HERE.values()


@pytest.mark.parametrize("fact", FACTS)
def test_every_fact_that_differs_is_told(fact):
    other = {**HERE, fact: "something else"}
    assert len(changes(HERE, other)) == 1
    assert digest(other) != digest(HERE)


def test_a_controllers_files_are_told_one_by_one():
    was = changed(sources_controller='{"a.py": "1", "b.py": "2"}')
    now = changed(sources_controller='{"a.py": "3", "c.py": "4"}')
    assert changes(was, now) == ("a.py changed", "b.py is gone", "c.py was added")


def test_what_an_earlier_version_did_not_record_is_one_line():
    (line,) = changes({}, HERE)
    assert line.startswith(
        "written by an earlier version of mjnav, which did not record the digest of mjnav's sources, "
    )
    (line,) = changes(changed(blas=None), HERE)
    assert line.endswith(" did not record BLAS")


@pytest.mark.parametrize("text", ["[1]", "{", "[" * 100_000, '"x"'])
def test_a_record_of_sources_that_is_none_does_no_harm(text):
    assert changes(changed(sources_controller=text), HERE) == ("the record of the plug-ins' sources is gone",)


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """Writes files, imports a module of them and says which files are behind it."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)

    def write(module: str, **files: str) -> set[str]:
        for name, text in files.items():
            path = tmp_path / f"{name.replace('__', '/').replace('//', '/__')}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        importlib.invalidate_caches()
        importlib.import_module(module)
        return set(plugin_sources(ControllerPlugin, f"{module}:Own"))

    yield write
    for name in set(sys.modules) - before:
        if name.partition(".")[0].startswith("lab"):
            del sys.modules[name]


def test_mjnavs_own_controllers_have_none():
    assert plugin_sources(ControllerPlugin, "rkhs") == {}
    assert plugin_sources(ControllerPlugin, "never_imported:Own") == {}
    assert len(mjnav_sources()) == 16


LAZY = "import importlib\ndef later():\n    import lab_late\n    importlib.import_module('lab_named')\n"
CIRCULAR = "def later():\n    import lab_broken, lab_round\n"
IMPORTS = {  # files by name, the one that is imported first, and those that do not count
    "over several steps": ({"lab_a": "import lab_b", "lab_b": "from lab_c import x", "lab_c": "x = 1"}, {"lab_x": ""}),
    "in a function or by name": ({"lab_lazy": LAZY, "lab_late": "", "lab_named": ""}, {}),
    "broken or circular": ({"lab_round": CIRCULAR, "lab_broken": "def (:\n"}, {}),
    "installed, or mjnav's": ({"lab_installed": "import json, numpy, mjnav.control.base, queue, numba.core\n"}, {}),
}


@pytest.mark.parametrize("kind", IMPORTS)
def test_what_a_module_may_import_counts_and_nothing_else(sources, kind):
    behind, other = IMPORTS[kind]
    assert sources(next(iter(behind)), **behind, **other) == {f"{name}.py" for name in behind}


def test_a_package_counts_with_its_parents_and_relative_imports(sources, tmp_path):
    (tmp_path / "labs/inner").mkdir(parents=True)
    (tmp_path / "labs/__init__.py").write_text("")
    (tmp_path / "labs/inner/__init__.py").write_text("from . import first")
    (tmp_path / "labs/inner/first.py").write_text("from ..second import *\nfrom .. import third")
    (tmp_path / "labs/second.py").write_text("")
    (tmp_path / "labs/third.py").write_text("")
    (tmp_path / "labs/fourth.py").write_text("")
    (tmp_path / "labs/own.py").write_text("from labs.inner import first")
    names = ("__init__", "own", "second", "third", "inner/__init__", "inner/first")
    assert sources("labs.own") == {f"labs/{name}.py" for name in names}


def test_a_digest_is_of_the_content_and_finding_it_imports_nothing(sources, tmp_path):
    files = {"lab_digest": "def later():\n    import lab_never\n", "lab_never": "raise SystemExit\n"}
    sources("lab_digest", **files)
    found = plugin_sources(ControllerPlugin, "lab_digest:Own")
    assert len(set(found.values())) == 2
    assert "lab_never" not in sys.modules
    assert Path(tmp_path / "lab_digest.py").exists()

"""The files behind a controller of one's own: all that its module may import from the user's sources, and no others."""

import importlib
import sys
from pathlib import Path

import pytest

from mjnav.loop.provenance import mjnav_sources, plugin_sources
from mjnav.settings.plugins import ControllerPlugin


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


def test_what_is_imported_over_several_steps_counts(sources):
    files = {"lab_a": "import lab_b", "lab_b": "from lab_c import x", "lab_c": "x = 1", "lab_unused": ""}
    assert sources("lab_a", **files) == {"lab_a.py", "lab_b.py", "lab_c.py"}


def test_what_is_imported_in_a_function_or_by_name_counts(sources):
    text = "import importlib\ndef later():\n    import lab_late\n    importlib.import_module('lab_named')\n"
    files = {"lab_lazy": text, "lab_late": "", "lab_named": ""}
    assert sources("lab_lazy", **files) == {"lab_lazy.py", "lab_late.py", "lab_named.py"}


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


def test_installed_packages_pythons_own_and_mjnav_do_not_count(sources):
    text = "import json, numpy, mjnav.control.base, queue, numba.core\n"
    assert sources("lab_installed", lab_installed=text) == {"lab_installed.py"}


def test_a_broken_or_circular_sibling_is_digested_and_does_no_harm(sources):
    text = "def later():\n    import lab_broken, lab_round\n"
    files = {"lab_round": text, "lab_broken": "def (:\n"}
    assert sources("lab_round", **files) == {"lab_round.py", "lab_broken.py"}


def test_a_digest_is_of_the_content_and_finding_it_imports_nothing(sources, tmp_path):
    files = {"lab_digest": "def later():\n    import lab_never\n", "lab_never": "raise SystemExit\n"}
    sources("lab_digest", **files)
    found = plugin_sources(ControllerPlugin, "lab_digest:Own")
    assert len(set(found.values())) == 2
    assert "lab_never" not in sys.modules
    assert Path(tmp_path / "lab_digest.py").exists()

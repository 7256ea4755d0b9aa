"""Machine code is that of the sources: never of an older version, of another's file, or of a damaged one."""

import os
import shutil
from pathlib import Path

import pytest

from tests.attacks.kernel_processes import Kernels

MJNAV = Path(__file__).parents[2] / "mjnav"
# Prints what `integrate_rows` gives, into which `wrapped` of another file is compiled, and what numba compiled.
PROGRAM = """
import numpy as np
from numba.core import event
recorder = event.RecordingListener()
event.register("numba:compile", recorder)
from mjnav.compile.compiled import load_kernels
from mjnav.motion.unicycle import integrate_rows
load_kernels()
moved = integrate_rows(np.array([[0.0, 0.0, 3.0]]), np.array([1.0]), np.array([1.0]), 1.0)
compiled = {e.data["dispatcher"].py_func.__name__ for _, e in recorder.buffer if e.is_start}
print(moved.tobytes().hex(), *sorted(compiled))
"""


@pytest.fixture(scope="module")
def kernels():
    with Kernels() as kernels:
        yield kernels


@pytest.fixture(scope="module")
def compiled(kernels, tmp_path_factory):
    """A cache folder with the kernels in it, and what the program printed when it compiled them."""
    cache = tmp_path_factory.mktemp("cache")
    (ended,) = kernels.run(PROGRAM, {"SOURCES": str(MJNAV.parent), "XDG_CACHE_HOME": str(cache)})
    assert ended.err == ""
    assert "integrate_rows" in ended.out.split()
    return cache, ended.out.split()[0]


@pytest.fixture
def environment(compiled, tmp_path):
    """A process's environment: sources of its own and a filled cache of its own."""
    sources = tmp_path / "sources"
    for folder in ("", "compile", "geometry", "motion"):
        (sources / "mjnav" / folder).mkdir(parents=True, exist_ok=True)
        for file in (MJNAV / folder).glob("*.py"):
            shutil.copy(file, sources / "mjnav" / folder)
    shutil.copytree(compiled[0], tmp_path / "cache")
    return {"SOURCES": str(sources), "XDG_CACHE_HOME": str(tmp_path / "cache")}


def files(environment):
    return sorted(Path(environment["XDG_CACHE_HOME"]).rglob("*.kernel"))


def test_an_edit_of_a_scalar_in_another_file_is_seen_at_once(kernels, environment, compiled):
    assert kernels.run(PROGRAM, environment)[0].out.split() == [compiled[1]]
    heading = Path(environment["SOURCES"]) / "mjnav" / "geometry" / "angles.py"
    stamp = heading.stat()
    source = heading.read_text()
    assert "2.0 * pi" in source
    heading.write_text(source.replace("2.0 * pi", "3.0 * pi"))
    os.utime(heading, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    changed, again = (kernels.run(PROGRAM, environment)[0] for _ in range(2))
    assert changed.out.split()[0] != compiled[1]
    assert "integrate_rows" in changed.out
    assert again.out.split() == [changed.out.split()[0]]
    heading.write_text(source)
    assert kernels.run(PROGRAM, environment)[0].out.split() == [compiled[1]]


def test_damaged_files_are_dropped_and_compiled_anew(kernels, environment, compiled):
    for number, file in enumerate(files(environment)):
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 0x10
        file.write_bytes((content[: len(content) // 2], content, b"")[number % 3])

    ended, again = (kernels.run(PROGRAM, environment)[0] for _ in range(2))
    assert (ended.code, ended.out.split()[0]) == (0, compiled[1])
    (line,) = ended.err.splitlines()
    assert "a damaged file is replaced, its kernel compiled anew" in line
    assert (again.out.split(), again.err) == ([compiled[1]], "")


@pytest.mark.parametrize("home", [{"HOME": "/dev/null", "XDG_CACHE_HOME": ""}, {"XDG_CACHE_HOME": "/proc"}])
def test_without_a_cache_folder_a_run_compiles_and_says_so_once(kernels, environment, compiled, home):
    (ended,) = kernels.run(PROGRAM, environment | home)
    assert (ended.code, ended.out.split()[0]) == (0, compiled[1])
    (line,) = ended.err.splitlines()
    assert line.startswith("mjnav: kernels are compiled anew at every start: ")


def test_cold_processes_at_once_all_end_alike(kernels, tmp_path, compiled):
    environment = {"SOURCES": str(MJNAV.parent), "XDG_CACHE_HOME": str(tmp_path)}
    ended = kernels.run(PROGRAM, *([environment] * 3))
    assert {(end.code, end.out.split()[0], end.err) for end in ended} == {(0, compiled[1], "")}
    assert not list(tmp_path.rglob("*.tmp"))

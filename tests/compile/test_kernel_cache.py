"""A kernel's digest changes with whatever is compiled into it; its file gives back what was written, or nothing."""

import importlib
import math
import os
import pkgutil
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types

import mjnav
from mjnav.compile import kernel_cache
from mjnav.compile.compiled import Kernel, exact, kernel, scalar
from mjnav.compile.kernel_cache import UNFINISHED, UNUSED, CacheFolder, code_digest, types_digest
from mjnav.filters import particles

# --------------------------------------------------------------------------------------------- digest

SOURCE = """
def inner(x):
    return x + NUMBER

inner = scalar(inner)

def middle(x):
    return inner(x) * 2.0

middle = kernel(middle)

def outer(x):
    return middle(x) - TABLE[1] + numpy.sqrt(x)
"""


class Pair(NamedTuple):
    first: float
    second: float


class Riap(NamedTuple):
    second: float
    first: float


def digest(source=SOURCE, options=None, **names):
    space = {"scalar": scalar, "kernel": kernel, "exact": exact, "numpy": np, "NUMBER": 1.0, "TABLE": (1, 2), **names}
    exec(source, space)
    outer = space["outer"]
    return code_digest(getattr(outer, "py_func", outer), options or {})


@pytest.mark.parametrize(
    ("found", "wanted"),
    [("x + NUMBER", "x - NUMBER"), ("* 2.0", "* 3.0"), ("* 2.0", "* 2"), ("kernel(middle)", "exact(middle)")],
)
def test_a_change_anywhere_below_a_kernel_changes_its_digest(found, wanted):
    assert found in SOURCE
    assert digest(SOURCE.replace(found, wanted)) != digest()


@pytest.mark.parametrize(
    "names", [{"NUMBER": 2.0}, {"NUMBER": 1}, {"NUMBER": -1.0}, {"TABLE": (1, 3)}, {"numpy": math}]
)
def test_a_constant_of_another_value_or_type_changes_the_digest(names):
    assert digest(**names) != digest()


def test_what_is_not_read_does_not_change_the_digest():
    assert digest("\n\n" + SOURCE, OTHER=3.0) == digest()


def test_numbas_options_change_the_digest():
    assert digest(options={"fastmath": {"nsz"}}) != digest(options={"fastmath": {"nsz", "arcp"}})


def test_the_digest_is_that_of_another_process():
    code = "from mjnav.compile.kernel_cache import code_digest\n"
    code += "from mjnav.filters.particles import weighted_moments as w\n"
    code += "print(code_digest(w.py_func, w.targetoptions))"
    moments: Any = particles.weighted_moments
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == code_digest(moments.py_func, moments.targetoptions)


@pytest.mark.parametrize("value", [object(), {1: 2}, [1.0], digest, sys])
def test_what_the_digest_cannot_see_through_is_refused(value):
    with pytest.raises(TypeError, match="a kernel reads"):
        digest(NUMBER=value)


def test_a_function_that_calls_itself_has_a_digest():
    source = "def outer(x):\n    return outer(x - 1) if x > 0 else 0\nouter = kernel(outer)"
    assert digest(source) == digest(source)


def test_the_order_of_a_named_tuples_fields_counts():
    fields = (types.float64, types.float64)
    assert types_digest((types.NamedTuple(fields, Pair),)) != types_digest((types.NamedTuple(fields, Riap),))


def test_a_named_tuple_of_another_module_is_another_type_also_where_its_fields_are_of_one_type():
    moved = type("Pair", (Pair,), {"__module__": "elsewhere"})
    here, there = (types.NamedUniTuple(types.float64, 2, kind) for kind in (Pair, moved))
    assert types_digest((here,)) != types_digest((there,))


def test_the_layout_of_an_array_counts():
    assert types_digest((types.float64[::1],)) != types_digest((types.float64[:],))


def test_every_kernel_of_mjnav_can_be_kept():
    for module in pkgutil.walk_packages(mjnav.__path__, "mjnav."):
        importlib.import_module(module.name)
    modules = [vars(module) for name, module in list(sys.modules.items()) if name.startswith("mjnav.")]
    kernels = {value for names in modules for value in names.values() if isinstance(value, Kernel)}
    assert len(kernels) > 60
    assert all(len(code_digest(each.py_func, each.targetoptions)) == 64 for each in kernels)


# ---------------------------------------------------------------------------------------------- files

DATA = bytes(range(256)) * 4


@pytest.fixture
def path(tmp_path):
    return tmp_path / "cache" / "mjnav" / "kernels"


@pytest.fixture
def folder(path):
    return CacheFolder(path)


def test_what_was_written_is_read_by_another_process(path, folder):
    folder.write("a", DATA)
    folder.write("a", DATA[::-1])
    assert CacheFolder(path).read("a") == DATA[::-1]
    assert folder.read("b") is None
    assert sorted(os.listdir(path)) == ["a.kernel"]


def test_folders_and_files_are_for_their_user_alone(tmp_path, path):
    before = os.umask(0)
    try:
        CacheFolder(path).write("a", DATA)
    finally:
        os.umask(before)
    made = (tmp_path / "cache", path.parent, path)
    assert [folder.stat().st_mode & 0o777 for folder in made] == [0o700] * 3
    assert (path / "a.kernel").stat().st_mode & 0o777 == 0o600


@given(st.integers(0, 8 * (len(DATA) + 32) - 1))
def test_one_flipped_bit_is_seen(tmp_path_factory, bit):
    path = tmp_path_factory.mktemp("flips")
    folder = CacheFolder(path)
    folder.write("a", DATA)
    content = bytearray((path / "a.kernel").read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    (path / "a.kernel").write_bytes(content)
    assert folder.read("a") is None


def test_one_kernels_file_is_not_taken_for_anothers(path, folder):
    folder.write("a", DATA)
    os.rename(path / "a.kernel", path / "b.kernel")
    assert folder.read("b") is None


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_a_folder_that_others_can_write_is_not_used(path, folder, capsys, mode):
    folder.write("a", DATA)
    path.chmod(mode)
    open_folder = CacheFolder(path)
    assert open_folder.read("a") is None
    open_folder.write("b", DATA)
    assert sorted(os.listdir(path)) == ["a.kernel"]
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"mjnav: kernels are compiled anew at every start: {path}: others can write into it"


def test_a_folder_of_another_user_is_not_used(path, folder, capsys):
    folder.write("a", DATA)
    if os.getuid() == 0:
        os.chown(path, 65534, -1)
    else:  # only root can give a folder away
        path = Path("/usr")
    assert CacheFolder(path).read("a") is None
    assert "it belongs to another user" in capsys.readouterr().err


def test_a_link_in_place_of_the_folder_is_not_followed(tmp_path, path, folder, capsys):
    folder.write("a", DATA)
    (tmp_path / "link").symlink_to(path)
    assert CacheFolder(tmp_path / "link").read("a") is None
    assert "kernels are compiled anew" in capsys.readouterr().err


def test_a_link_on_the_way_to_the_folder_is_followed(tmp_path, path, folder):
    folder.write("a", DATA)
    (tmp_path / "link").symlink_to(path.parent)
    assert CacheFolder(tmp_path / "link" / "kernels").read("a") == DATA


def test_neither_a_link_nor_a_pipe_nor_what_others_can_write_is_read(tmp_path, path, folder):
    folder.write("a", DATA)
    os.rename(path / "a.kernel", tmp_path / "elsewhere")
    (path / "a.kernel").symlink_to(tmp_path / "elsewhere")
    os.mkfifo(path / "b.kernel")
    folder.write("c", DATA)
    (path / "c.kernel").chmod(0o666)
    assert [folder.read(name) for name in "abc"] == [None, None, None]


def test_a_full_disk_leaves_no_half_file(path, folder, capsys):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(DATA) // 2, before[1]))
    try:
        folder.write("a", DATA)
        folder.write("b", DATA)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert os.listdir(path) == []
    assert capsys.readouterr().err.splitlines() == [
        f"mjnav: kernels are compiled anew at every start: {path}: File too large"
    ]


def test_what_no_process_read_for_weeks_is_deleted_and_what_is_read_stays(path, folder):
    for name in ("old", "read", "young"):
        folder.write(name, DATA)
    for name, age in (("old.kernel", UNUSED), ("read.kernel", UNUSED), ("x.tmp", UNFINISHED), ("y.tmp", 0.0)):
        (path / name).touch()
        moment = time.time() - age - 3600.0
        os.utime(path / name, (moment, moment))
    (path / "a note").touch()
    assert CacheFolder(path).read("read") == DATA
    CacheFolder(path).write("new", DATA)
    assert sorted(os.listdir(path)) == ["a note", "new.kernel", "read.kernel", "y.tmp", "young.kernel"]


def test_the_least_recently_used_go_where_there_are_too_many(path, folder, monkeypatch):
    for i in range(4):
        folder.write(str(i), DATA)
        os.utime(path / f"{i}.kernel", (time.time() - i, time.time() - i))
    monkeypatch.setattr(kernel_cache, "MAX_BYTES", 3 * (len(DATA) + 32))
    CacheFolder(path).write("new", DATA)
    assert sorted(os.listdir(path)) == ["0.kernel", "1.kernel", "new.kernel"]

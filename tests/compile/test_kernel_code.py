"""A kernel's digest changes with whatever is compiled into it, and with nothing else."""

import math
import subprocess
import sys
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import types

from mjnav.compile.compiled import exact, kernel, prepare, scalar
from mjnav.compile.kernel_cache import code_digest, types_digest

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
    prepare()  # decorators hand functions to numba from the first use of a kernel on
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
    from mjnav.filters import particles as weights

    w: Any = weights.weighted_moments
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == code_digest(w.py_func, w.targetoptions)


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
    import importlib
    import pkgutil

    from numba.core.dispatcher import Dispatcher

    import mjnav

    for module in pkgutil.walk_packages(mjnav.__path__, "mjnav."):
        importlib.import_module(module.name)
    modules = [vars(module) for name, module in list(sys.modules.items()) if name.startswith("mjnav.")]
    kernels = {value for names in modules for value in names.values() if isinstance(value, Dispatcher)}
    assert len(kernels) > 60
    for one in kernels:
        assert isinstance(one.py_func, FunctionType)
        assert len(code_digest(one.py_func, one.targetoptions)) == 64

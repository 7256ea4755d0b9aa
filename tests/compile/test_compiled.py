"""A process that compiles kernels computes the same bits as one that loads them."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from mjnav.compile.compiled import Vector, exact, kernel
from tests.attacks.kernel_processes import Kernels

SOURCES = str(Path(__file__).parents[2])
# Prints how many functions numba compiled and the moments of a disc and a wall, whose loops are in inner kernels.
MOMENTS = """
import numpy as np
from numba.core import event
recorder = event.RecordingListener()
event.register("numba:compile", recorder)
from mjnav.constraints.collision_cone import SEGMENT
from mjnav.control.kernels.cone_kernel import ConeBlocks, ConeRule, Controls, RobotSamples
from mjnav.control.kernels.cone_kernel import cone_moments
rng = np.random.default_rng(0)
num_controls, num_robot, num_disc = 32, 5, 4
turn, heading = rng.normal(0.0, 0.1, num_controls), rng.normal(0.0, 0.1, num_robot)
controls = Controls(rng.uniform(0.0, 1.0, num_controls), np.cos(turn), np.sin(turn))
noise = rng.normal(0.0, 0.1, (num_robot, 3))
robot = RobotSamples(noise[:, :2].copy(), noise[:, 2].copy(), np.cos(heading), np.sin(heading))
blocks = ConeBlocks(
    column=np.arange(2), start=np.array([0, num_disc, num_disc + 1]), num_discs=1,
    position=rng.normal([2.0, 0.0], 0.1, (num_disc + 1, 2)), velocity=rng.normal([-1.0, 0.0], 0.1, (num_disc + 1, 2)),
    radius_squared=np.array([0.36, 0.09]), unit=np.array([2.0, 3.0]), wall=np.array([[0.0] * 4, [-1.0, 1.0, 3.0, 1.0]]),
)
moments = np.empty((2, 3, num_controls))
circles = np.tile([0.5, 0.0, 0.6], (num_robot, 1))
cone_moments(moments, np.zeros(2, bool), circles, controls, robot, blocks, ConeRule(SEGMENT, 4.0, 2.0, -1.0))
print(sum(e.is_start for _, e in recorder.buffer), moments.tobytes().hex())
"""
# Prints each kernel and the functions outside it that are in its machine code.
FOREIGN = """
import sys
from contextlib import suppress
from importlib import import_module
from pkgutil import walk_packages
import mjnav
from mjnav.compile import compiled
for module in walk_packages(mjnav.__path__, "mjnav."):
    if not module.name.endswith("__main__"):
        with suppress(ImportError):  # of an extra that is not installed
            import_module(module.name)
compiled.load_kernels()
modules = [module for name, module in sys.modules.items() if name.startswith("mjnav.")]
for each in [v for module in modules for v in vars(module).values() if isinstance(v, compiled.Kernel)]:
    for kernel in each.compiled.overloads.values():
        mangled = kernel.fndesc.mangled_name.removeprefix("_ZN")
        functions = kernel.library._get_module_for_linking().functions
        foreign = [f.name for f in functions if not f.is_declaration and mangled not in f.name]
        print(kernel.fndesc.qualname, *foreign)
"""


def test_a_process_that_compiles_and_one_that_loads_give_the_same_bits(tmp_path):
    environment = {"SOURCES": SOURCES, "XDG_CACHE_HOME": str(tmp_path)}
    with Kernels() as kernels:
        (first,), (second,) = (kernels.run(MOMENTS, environment) for _ in range(2))
    assert first.code == second.code == 0, first.err + second.err
    (compiled, by_compiler), (loaded, by_loader) = first.out.split(), second.out.split()
    assert int(compiled) > 0
    assert int(loaded) == 0
    assert by_compiler == by_loader


def test_no_kernel_calls_the_machine_code_of_another():
    ended = subprocess.run([sys.executable, "-c", FOREIGN], capture_output=True, text=True, check=True)
    foreign = [line.split() for line in ended.stdout.splitlines()]
    kernels = {kernel for kernel, *_ in foreign}
    assert {"cone_samples", "_meet_discs", "_walls", "_conditional_value_at_risk", "_nearest", "_fit"} <= kernels
    # Sorting rounds nothing: any two copies of it give the same bits. Numba's own runtime has no name in C++ style.
    called = [
        (kernel, name)
        for kernel, *names in foreign
        for name in names
        if name.startswith("_ZN") and "quicksort" not in name
    ]
    assert called == []


def test_a_power_is_rounded_by_the_rules_of_its_own_kernel_whichever_was_compiled_first():
    def sum_of_squares(x: Vector):
        total = 0.0
        for i in range(len(x)):
            total += x[i] ** 2
        return total

    def others(x: Vector):
        return squares(x) ** 2

    fast, strict = kernel(sum_of_squares), exact(others)
    squares: Any = exact(sum_of_squares)
    for made in (fast, squares, strict):
        vars(made.compiled._cache)["_code"] = None  # kept nowhere: what is loaded cannot be inspected
    fast.load()
    strict.load()
    codes = ["\n".join(made.inspect_llvm().values()) for made in (fast, strict)]
    assert ["reassoc" in code for code in codes] == [True, False]


def test_a_helper_compiles_what_is_lacking_into_the_cache_of_this_process(tmp_path):
    program = (
        "from mjnav.compile import compiled\n"
        "import mjnav.motion.orca\n"
        "modules = ['mjnav.motion.orca']\n"
        "kernels = [k for k in compiled._kernels_of(modules) if compiled.declared(k.py_func)]\n"
        "print(*(k.lacking for k in kernels))\n"
        "print(compiled._helper(modules, 0.5).wait())\n"
        "print(*(k.lacking for k in kernels))\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": SOURCES}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    before, code, after = done.stdout.splitlines()
    assert code == "0"
    assert set(before.split()) == {"True"}
    assert set(after.split()) == {"False"}
    assert len(after.split()) == len(before.split())

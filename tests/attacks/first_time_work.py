"""What a run compiles, loads or imports after tick 0.

All runs share a process, so that a kernel counts where it is first needed and only there; the kernels that modules
declare are loaded before each run, as `warm_up` does, but no tick is thrown away.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count

import scipy.optimize  # noqa: F401 - the figures load it when a run has ended
from numba.core import event

import mjnav
from mjnav.compile.compiled import Kernel, load_kernels
from mjnav.loop.episode import Episode
from mjnav.loop.supervision import RunFault

RATES = (5, 10, 20, 50, 100, 200)  # [Hz]
ROBOT = (
    'source="pose",filter="particle"',
    'source="pose",filter="ekf"',
    'source="direct"',
)
PEOPLE = (
    'source="detections",filter="particle"',
    'source="detections",filter="kalman"',
    'source="detections",filter="rao-blackwell"',
    'source="direct"',
)


def known() -> set[str]:
    """Every kernel of mjnav for the types that it is loaded for, and every module."""
    loaded = set(sys.modules)
    for module in [vars(module) for name, module in list(sys.modules.items()) if name.startswith("mjnav.")]:
        for kernel in [value for value in module.values() if isinstance(value, Kernel) and "compiled" in vars(value)]:
            dispatcher = getattr(kernel.compiled, "_dispatcher", kernel.compiled)
            loaded |= {f"{kernel.__qualname__}{signature}" for signature in dispatcher.overloads}
    return loaded


@contextmanager
def first_time_work() -> Iterator[list[str]]:
    """What happens for the first time within a `with` block: compiled, loaded and imported, in words."""
    work: list[str] = []
    listener = event.RecordingListener()
    kinds = ("numba:compile", "numba:run_pass")
    for kind in kinds:
        event.register(kind, listener)
    before = known()
    try:
        yield work
    finally:
        for kind in kinds:
            event.unregister(kind, listener)
    work += sorted({e.data["dispatcher"].py_func.__name__ for _, e in listener.buffer if e.kind == kinds[0]})
    work += sorted({"a pass of the compiler" for _, e in listener.buffer if e.kind == kinds[1]})
    work += sorted(known() - before)


def late_work(scene: str, overrides: Sequence[str] = (), *, ticks: int = 10**9, **options) -> list[str]:
    """The first-time work of an episode from tick 0 to its end; `options` are those of `Episode`."""
    asked = count()
    episode = Episode(mjnav.load_scenario(scene, overrides), stop=lambda: next(asked) >= ticks, cones=True, **options)
    load_kernels()
    with first_time_work() as work, suppress(RunFault):
        episode.run()
    return work


def settings(method: str, robot: str, people: str, rate: float, *more: str) -> list[str]:
    """Overrides for a method, two filters and a rate [Hz]."""
    estimation = [f"estimation.robot.{part}" for part in robot.split(",")]
    estimation += [f"estimation.obstacles.{part}" for part in people.split(",")]
    timestep = "physics.timestep=0.001"  # whose multiples the periods of all rates are
    return [f'control.method="{method}"', timestep, f"control.rate={rate}", *estimation, *more]

"""mjnav: robot navigation under non-Gaussian uncertainty, in MuJoCo.

import mjnav
result = mjnav.run("hall", seed=3)
print(result.summary["outcome"], result.summary["min_clearance_m"])
"""

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjnav.loop.prepare import load_scenario
    from mjnav.loop.replay import replay
    from mjnav.loop.run import run
    from mjnav.loop.simulation import Simulation
    from mjnav.notebook import open_log
    from mjnav.report.log_pictures import render
    from mjnav.report.run_page.of_logs import report
    from mjnav.study.key_reference import names
    from mjnav.study.results import compare, sweep

__all__ = ["Simulation", "compare", "load_scenario", "names", "open_log", "render", "replay", "report", "run", "sweep"]

# name -> where it is; imported when first asked for, so that `import mjnav` is cheap
_API = MappingProxyType(
    {
        "Simulation": "mjnav.loop.simulation",
        "compare": "mjnav.study.results",
        "load_scenario": "mjnav.loop.prepare",
        "names": "mjnav.study.key_reference",
        "open_log": "mjnav.notebook",
        "render": "mjnav.report.log_pictures",
        "replay": "mjnav.loop.replay",
        "report": "mjnav.report.run_page.of_logs",
        "run": "mjnav.loop.run",
        "sweep": "mjnav.study.results",
    }
)


def __getattr__(name: str) -> Any:
    if name not in _API:
        raise AttributeError(f"module 'mjnav' has no attribute {name!r}")
    return getattr(import_module(_API[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_API])

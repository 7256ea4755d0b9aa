"""The figures and claims of Nair et al. (arXiv 2112.13034), measured again.

An item is a figure with its claims. It is judged by the episodes of studies (`runs/studies/paper-*.toml`) or by a
measurement of its own; `claims` says how, `page` puts what became of all items on one page.
"""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mjnav.paper.claims import Item

ITEMS: Mapping[str, str] = MappingProxyType(  # the name of an item -> module:name of it, in the order of the page
    {
        "surface": "surface:SURFACE",
        "snapshots": "snapshots:SNAPSHOTS",
        "degree": "comparisons:DEGREE",
        "table": "comparisons:TABLE",
        "lane": "comparisons:LANE",
        "one": "comparisons:ONE",
        "many": "comparisons:MANY",
        "reading": "comparisons:STRONGEST",
        "pareto": "pareto:PARETO",
        "shape": "comparisons:SHAPE",
        "factors": "comparisons:FACTORS",
        "real_time": "comparisons:REAL_TIME",
    }
)


def load(name: str) -> "Item":
    """The item of a name in ITEMS."""
    module, _, constant = ITEMS[name].partition(":")
    return getattr(import_module(f"mjnav.paper.{module}"), constant)

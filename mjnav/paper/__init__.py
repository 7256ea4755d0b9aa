"""The figures and claims of Nair et al. (arXiv 2112.13034), measured again: one file a figure.

A figure's file holds its claims, the study or the measurement that they are judged by, and the picture; `items` lists
them all, `page` puts what became of them on one page.
"""

from collections.abc import Mapping
from types import MappingProxyType

MODULES: Mapping[str, str] = MappingProxyType(  # the name of an item -> the file in which its ITEM is, in their order
    {
        "surface": "cost_surface",
        "snapshots": "snapshots",
        "paths": "paths",
        "degree": "degree",
        "table": "table",
        "lane": "lane",
        "one": "one",
        "many": "many",
        "kld": "kld",
        "pareto": "pareto",
        "shape": "shape",
        "factors": "factors",
        "real_time": "real_time",
    }
)

"""Every item of the paper, by the name of its folder and of `mjnav paper --only`."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.paper import (
    cost_surface,
    degree,
    factors,
    kld,
    lane,
    many,
    one,
    pareto,
    paths,
    real_time,
    shape,
    snapshots,
    table,
)
from mjnav.paper.item import Item

ITEMS: Mapping[str, Item] = MappingProxyType(
    {
        "surface": cost_surface.ITEM,
        "snapshots": snapshots.ITEM,
        "paths": paths.ITEM,
        "degree": degree.ITEM,
        "table": table.ITEM,
        "lane": lane.ITEM,
        "one": one.ITEM,
        "many": many.ITEM,
        "kld": kld.ITEM,
        "pareto": pareto.ITEM,
        "shape": shape.ITEM,
        "factors": factors.ITEM,
        "real_time": real_time.ITEM,
    }
)

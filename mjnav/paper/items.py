"""Every item of the paper, by the name of its folder and of `mjnav paper --only`."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from mjnav.paper import MODULES
from mjnav.paper.item import Item

ITEMS: Mapping[str, Item] = MappingProxyType(
    {name: import_module(f"mjnav.paper.{module}").ITEM for name, module in MODULES.items()}
)

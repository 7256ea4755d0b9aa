"""Plug-ins that installed packages register under an entry point.

Names and owners are read from the packages' metadata, which imports nothing; a plug-in is imported when it is used.
"""

import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType

from mjnav.errors import InvalidValue
from mjnav.plugins.kinds import Kind


@dataclass(frozen=True, slots=True)
class Registered:
    """A name that a package registers: the place of its class, "package.module:Class", and the package."""

    name: str
    place: str
    owner: str  # the package and its version


def registered(kind: Kind) -> Mapping[str, tuple[Registered, ...]]:
    """All that is registered of a kind, by name; more than one under a name is a clash."""
    return _registered(kind.group, tuple(sys.path))


@cache
def _registered(group: str, path: tuple[str, ...]) -> Mapping[str, tuple[Registered, ...]]:
    found: dict[str, tuple[Registered, ...]] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, _owner(point))):
        entry = Registered(point.name, point.value.replace(" ", ""), _owner(point))
        found[point.name] = (*found.get(point.name, ()), entry)
    return MappingProxyType(found)


def _owner(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"


def refuse_clash(kind: Kind, name: str, shipped: Collection[str]) -> None:
    """Raises InvalidValue where more than one registers `name`, mjnav with its `shipped` names among them."""
    owners = [entry.owner for entry in registered(kind).get(name, ())]
    owners = ["mjnav"] * (name in shipped) + owners
    if len(owners) > 1:
        allowed = (
            f"a {kind.name} that one package registers, not {' and '.join(owners)}; package.module:Class names one"
        )
        raise InvalidValue(kind.key, name, allowed)

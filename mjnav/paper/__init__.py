"""What each figure of Nair et al. (arXiv 2112.13034) shows, measured again.

An item is a module of this folder. One that rests on episodes names its study files in STUDIES and judges their rows in
`findings(cells)`; another has `measure(scenarios)` and judges what that returns.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType, ModuleType

DIRECT = ("estimation.robot.source=direct", "estimation.obstacles.source=direct")  # the paper's samples
TUNED_3 = ("control.degree=3", "control.weight=0.3")  # by paper-tuning
KINEMATIC = "physics.engine=kinematic"  # its engine


@dataclass(frozen=True, slots=True)
class Item:
    """A figure of the paper. A measurement has scenes and what is set in them; a sweep has study files of its own."""

    title: str
    scenes: tuple[str, ...] = ()
    overrides: tuple[str, ...] = ()

    @property
    def is_sweep(self) -> bool:
        """Whether it rests on the rows of studies."""
        return not self.scenes


ITEMS: Mapping[str, Item] = MappingProxyType(
    {
        "surface": Item(
            "The cost over (v, ω), and a gradient method against samples", ("crossing1", "crossing3"), DIRECT
        ),
        "snapshots": Item("Five moving obstacles: samples and distributions", ("five",), (*DIRECT, *TUNED_3)),
        "paths": Item("The degree of the kernel: ways and distributions", ("crossing1",), (*DIRECT, KINEMATIC)),
        "degree": Item("The degree of the kernel, against one obstacle"),
        "table": Item("The table: between its legs or around it"),
        "lane": Item("The lane: distance from its boundary"),
        "one": Item("One obstacle: control cost, deviation, time to avoid"),
        "many": Item("One, two and three obstacles"),
        "kld": Item("Matching by MMD against matching by KL divergence"),
        "pareto": Item("Every method over its own parameter"),
        "shape": Item("Does the method use the shape of the noise?"),
        "factors": Item("Cone form, preview, prediction of the delay"),
        "real_time": Item("Real time: decisions a second", ("five",), DIRECT),
    }
)


def module(name: str) -> ModuleType:
    """The item's module."""
    return import_module(f"{__name__}.{name}")

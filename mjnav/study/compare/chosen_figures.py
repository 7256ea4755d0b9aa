"""Which figures a table has: rates, the default ones, those asked for by name, and whole groups of them."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from mjnav.errors import unknown_name
from mjnav.metrics.definitions import DERIVED, FIGURES, GROUPS, STRING, TRUTH, Definition
from mjnav.metrics.safety import KINDS
from mjnav.study.store.own_figures import columns_of, is_own
from mjnav.study.store.row import COLUMNS

COLLISIONS = tuple(f"collisions_{kind}" for kind in KINDS)
RATES = ("success", "collision")  # always among the figures
FAULT, FAULTS = "fault", "robot_at_fault"  # a rate, and the column of which it is made
DEFAULT_FIGURES = (
    *(FAULT, "time_s", "control_cost", "mean_deviation_m", "path_ratio", "min_clearance_m"),
    *("stalled_s", "min_human_distance_m", "personal_space_share"),
)
PEOPLE, LAYOUT = "people_see_robot", "layout"  # columns of text, which describe a table
_KNOWN: Mapping[str, Definition] = MappingProxyType({**FIGURES, **DERIVED})
_DERIVED_RATES = tuple(name for name, definition in DERIVED.items() if definition.type == TRUTH)


def is_rate(figure: str) -> bool:
    """Whether a figure is a truth of each episode, of which tables have the share in per cent."""
    return figure in _KNOWN and _KNOWN[figure].type == TRUTH


def over_all(figure: str) -> bool:
    """Whether a figure's mean is over all episodes, and not only over those that succeeded."""
    return figure in _KNOWN and _KNOWN[figure].over_all


def expanded(figures: Iterable[str]) -> tuple[str, ...]:
    """The figures with those of a group in place of its name, each once; a group's texts and the rates are left out."""
    found: list[str] = []
    for figure in figures:
        group = GROUPS.get(figure)
        found += [figure] if group is None else [name for name, one in group.items() if one.type != STRING]
    return tuple(figure for figure in dict.fromkeys(found) if figure not in RATES)


def columns_for(figures: Iterable[str]) -> list[str]:
    """The columns of the store that these figures are made of."""
    return columns_of(FAULTS if figure == FAULT else figure for figure in figures)


def numbers() -> list[str]:
    """Every figure that a table may have: rates, and columns of numbers."""
    return list(dict.fromkeys((*_DERIVED_RATES, *(name for name, column in COLUMNS.items() if column.type != STRING))))


def check_figures(figures: Iterable[str]) -> None:
    """Raises InvalidValue for a name that is no figure of a table, and none that a user's own metric may have."""
    allowed = numbers()
    for figure in figures:
        if figure not in allowed and not is_own(figure):
            raise unknown_name("figure", figure, [*allowed, *GROUPS])

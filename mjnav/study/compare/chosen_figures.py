"""Which figures a table has: rates, the default ones, those asked for by name, and whole groups of them."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from mjnav.errors import unknown_name
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, NUMBER, STRING, TRUTH, Definition
from mjnav.metrics.safety import KINDS, PERSON
from mjnav.metrics.summary import DERIVED, FIGURES, GROUPS
from mjnav.study.store.row import COLUMNS, columns_of, is_own

COLLISIONS = tuple(f"collisions_{kind}" for kind in KINDS)
RATES = ("success", "collision")  # always among the figures
FAULT = "fault"
# rate -> the columns of counts of which one at least is above 0
HAPPENED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        FAULT: ("robot_at_fault",),
        "collision_moving": ("collisions_moving",),
        "collision_at_rest": ("collisions_at_rest",),
        "collision_thing": tuple(name for name in COLLISIONS if name != f"collisions_{PERSON}"),
    }
)
DEFAULT_FIGURES = (
    *(FAULT, "time_s", "control_cost", "mean_deviation_m", "path_ratio", "min_clearance_m"),
    *("stalled_s", "min_human_distance_m", "personal_space_share"),
)
# What a study of methods is judged by; the rates, times of decisions and the win ratio are in all tables.
HEADLINE = "headline"
SETS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        HEADLINE: (
            *(*HAPPENED, "timeout"),
            *("time_s", "control_cost", "mean_deviation_m", "min_clearance_m"),
        )
    }
)
WIN_BY = "time_s"  # the cost that decides between two successes
PEOPLE, LAYOUT = "people_see_robot", "layout"  # columns of text, which describe a table
_KNOWN: Mapping[str, Definition] = MappingProxyType({**FIGURES, **DERIVED})
_DERIVED_RATES = tuple(name for name, definition in DERIVED.items() if definition.type == TRUTH)


def is_rate(figure: str) -> bool:
    """Whether a figure is a truth of each episode, of which tables have the share in per cent."""
    return figure in _KNOWN and _KNOWN[figure].type == TRUTH


def is_cost(figure: str) -> bool:
    """Whether a figure is a quantity of which less is better, so that ratios of its means say something."""
    known = _KNOWN.get(figure)
    return known is not None and known.type == NUMBER and known.better == LOWER


def over_all(figure: str) -> bool:
    """Whether a figure's mean is over all episodes, and not only over those that succeeded."""
    return figure in _KNOWN and _KNOWN[figure].over_all


def expanded(figures: Iterable[str]) -> tuple[str, ...]:
    """The figures with those of a group in place of its name, each once; a group's texts and the rates are left out."""
    found: list[str] = []
    for figure in figures:
        if figure in GROUPS:
            found += [name for name, one in GROUPS[figure].items() if one.type != STRING]
        else:
            found += SETS.get(figure, (figure,))
    return tuple(figure for figure in dict.fromkeys(found) if figure not in RATES)


def columns_for(figures: Iterable[str]) -> list[str]:
    """The columns of the store that these figures are made of."""
    return columns_of(column for figure in figures for column in HAPPENED.get(figure, (figure,)))


def numbers() -> list[str]:
    """Every figure that a table may have: rates, and columns of numbers."""
    return list(dict.fromkeys((*_DERIVED_RATES, *(name for name, column in COLUMNS.items() if column.type != STRING))))


def check_figures(figures: Iterable[str]) -> None:
    """Raises InvalidValue for a name that is no figure of a table, and none that a user's own metric may have."""
    allowed = numbers()
    for figure in figures:
        if figure not in allowed and not is_own(figure):
            raise unknown_name("figure", figure, [*allowed, *GROUPS, *SETS])


def check_win_by(figure: str) -> None:
    """Raises InvalidValue for a figure by which two successes cannot be compared, as neither low nor high is better."""
    allowed = [name for name, one in FIGURES.items() if one.type in (NUMBER, INTEGER) and one.better]
    if figure not in allowed:
        raise unknown_name("win_by", figure, allowed)


def more_is_better(figure: str) -> bool:
    """Whether the higher value of a figure is the better one."""
    return FIGURES[figure].better == HIGHER

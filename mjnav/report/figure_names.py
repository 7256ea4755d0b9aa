"""What figures are called in tables and charts, their units, and what they are, from `metrics.definitions`."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from mjnav.metrics.definitions import DERIVED, FIGURES, GROUPS, TRUTH, Definition

_KNOWN: Mapping[str, Definition] = MappingProxyType({**FIGURES, **DERIVED})


OTHERS = "others"  # figures of no group


class FigureName(NamedTuple):
    """A figure in words, and its unit: "" where it has none."""

    words: str
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words


_SHARES = ("infeasible_share",)  # that tables show in per cent, as they do truths


def figure_name(column: str) -> FigureName:
    """The words and the unit of a figure; of one that has no words of its own, its name without the unit at its end.

    Rates are shown in per cent.
    """
    known = _KNOWN.get(column, Definition(text=""))
    shown_in = "%" if known.type == TRUTH or column in _SHARES else known.unit
    if known.words:
        return FigureName(known.words, shown_in)
    return FigureName(column.removesuffix(f"_{shown_in}").replace("_", " "), shown_in)


def unit(column: str) -> str:
    """The unit of a figure's own value; "" of a plain number, a share or a truth."""
    return _KNOWN[column].unit if column in _KNOWN else ""


def definition(key: str) -> str:
    """What a figure is, by its column or its key in `mjnav inspect --json`; "" where nothing is known of it."""
    column = key.removeprefix("figures.").removeprefix("timing.").removeprefix("result.").replace(".", "_")
    return _KNOWN[column].about if column in _KNOWN else ""


def by_group(keys: Iterable[str]) -> dict[str, list[str]]:
    """Figures of a run, by their keys in `mjnav inspect --json`, under the name of their group; others come last."""
    found: dict[str, list[str]] = {name: [] for name in (*GROUPS, OTHERS)}
    for key in keys:
        found[_group(key.removeprefix("figures.").replace(".", "_"))].append(key)
    return {name: own for name, own in found.items() if own}


def _group(column: str) -> str:
    """The group of a figure, or of a table of figures, whose columns begin with its name."""
    for name, figures in GROUPS.items():
        if column in figures or any(figure.startswith(f"{column}_") for figure in figures):
            return name
    return OTHERS

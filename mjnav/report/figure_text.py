"""A figure as people read it: its words, its unit, its definition; its value with as many digits as mean something.

A column of a table has as many decimals as its narrowest interval needs for one digit of its half width:
12.34 [11.82, 12.91], and the difference +0.61 [+0.20, +1.10] below it, or the ratio of a cost ×0.95 [0.91, 0.99].
Ratios have three digits. A star marks what is beyond chance.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import floor, isfinite, isnan, log10
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from mjnav.metrics.definitions import TRUTH, Definition
from mjnav.metrics.summary import DERIVED, FIGURES, GROUPS

if TYPE_CHECKING:
    from mjnav.study.compare.estimates import Estimate

# --------------------------------------------------------------------------------- names, definitions

_KNOWN: Mapping[str, Definition] = MappingProxyType({**FIGURES, **DERIVED})
_SHARES = ("infeasible_share",)  # that tables show in per cent, as they do truths
OTHERS = "others"  # figures of no group


class FigureName(NamedTuple):
    """A figure in words, and its unit: "" where it has none."""

    words: str
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words


def figure_name(column: str) -> FigureName:
    """The words and the unit of a figure; rates are shown in per cent."""
    known = _KNOWN.get(column) or Definition(column, "")
    return FigureName(known.words, "%" if known.type == TRUTH or column in _SHARES else known.unit)


def unit(column: str) -> str:
    """The unit of a figure's own value; "" of a plain number, a share or a truth."""
    return _KNOWN[column].unit if column in _KNOWN else ""


def definition(key: str) -> str:
    """What a figure is, by its column or its key in `mjnav inspect --json`; "" where nothing is known of it."""
    column = key.removeprefix("figures.").removeprefix("timing.").removeprefix("result.").replace(".", "_")
    return _KNOWN[column].about if column in _KNOWN else ""


def by_group(keys: Iterable[str]) -> dict[str, list[str]]:
    """Figures of a run, by their keys in `mjnav inspect --json`, under the name of their group; others come last."""
    groups: dict[str, list[str]] = {name: [] for name in (*GROUPS, OTHERS)}
    for key in keys:
        groups[_group(key.removeprefix("figures.").replace(".", "_"))].append(key)
    return {name: keys_of_group for name, keys_of_group in groups.items() if keys_of_group}


def _group(column: str) -> str:
    """The group of a figure, or of a table of figures, whose columns begin with its name."""
    for name, figures in GROUPS.items():
        if column in figures or any(figure.startswith(f"{column}_") for figure in figures):
            return name
    return OTHERS


# --------------------------------------------------------------------------------------------- values

ALPHA = 0.05  # below it a difference is marked
MAX_DECIMALS = 6
NEGLIGIBLE = 1e-4  # of the widest interval: what is narrower is rounding
DASH = "-"
NEVER = "\N{INFINITY}"  # the win ratio of a method that lost no pair


@dataclass(frozen=True, slots=True)
class Shown:
    """An estimate in parts; "-" and nothing where it is undefined."""

    value: str
    interval: str = ""  # [low, high]
    count: str = ""  # (4): how many seeds, where they are not all of the row's
    estimate: "Estimate | None" = None  # of which it was made
    p: float | None = None  # of a difference or a win ratio

    @property
    def marked(self) -> bool:
        """Whether it is beyond chance."""
        return is_marked(self.p) and self.value != DASH

    def __str__(self) -> str:
        return " ".join(part for part in (self.value, self.interval, self.count, "*" * self.marked) if part)


def is_marked(p: float | None) -> bool:
    """Whether a p-value gets a star."""
    return p is not None and p < ALPHA


@dataclass(frozen=True, slots=True)
class Format:
    """How the values of one column are printed."""

    decimals: int
    scale: float = 1.0  # 100 for what is shown in per cent

    def shown(self, e: "Estimate", num: int, sign: str = "", p: float | None = None) -> Shown:
        """An estimate; `num` is how many seeds its row has, and "+" the sign of differences."""
        value = self._number(e.value, sign) if isfinite(e.value) else DASH
        return _shown(value, [self._number(end, sign) for end in e.interval or ()], e, num, p)

    def _number(self, value: float, sign: str) -> str:
        rounded = round(self.scale * value, self.decimals) + 0.0  # no -0.0
        return f"{rounded:{sign if rounded else ''}.{self.decimals}f}"


def shown_ratio(e: "Estimate | None", num: int, sign: str = "", p: float | None = None) -> Shown:
    """A ratio: 0.953 [0.912, 0.995]; `num` is how many seeds its row has."""
    if e is None:
        return Shown(DASH)
    return _shown(DASH if isnan(e.value) else sign + _digits(e.value), [*map(_digits, e.interval or ())], e, num, p)


def _shown(value: str, ends: list[str], e: "Estimate", num: int, p: float | None) -> Shown:
    interval = f"[{', '.join(ends)}]" if ends and value != DASH else ""
    return Shown(value, interval, f"({e.num})" if e.num != num else "", e, p)


def _digits(ratio: float) -> str:
    if not isfinite(ratio):
        return NEVER
    return f"{ratio:.{0 if ratio >= 100.0 else 1 if ratio >= 10.0 else 2 if ratio >= 1.0 else 3}f}"


def column_format(estimates: "Iterable[Estimate]", *, rate: bool) -> Format:
    """With as many decimals as the narrowest interval of a column needs; without intervals 3, of rates none."""
    scale = 100.0 if rate else 1.0
    halves = [0.5 * scale * (e.interval[1] - e.interval[0]) for e in estimates if e.interval is not None]
    least = min((half for half in halves if half > NEGLIGIBLE * max(halves)), default=0.0)
    if not least:  # values that are all the same
        return Format(0 if rate else 3, scale)
    return Format(min(max(-floor(log10(least)), 0), MAX_DECIMALS), scale)

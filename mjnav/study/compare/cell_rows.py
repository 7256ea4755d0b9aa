"""The rows of a sweep by cell: a scene under a setting and a method; and the cells of several scenes joined to one.

Which figures a table has: rates, the default ones, those asked for by name, and whole groups of them.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import unknown_name
from mjnav.messages import Array
from mjnav.metrics.definitions import LOWER, NUMBER, STRING, TRUTH, Definition
from mjnav.metrics.safety import KINDS, PERSON
from mjnav.metrics.summary import DERIVED, FIGURES, GROUPS
from mjnav.study.store import CELL, COLUMNS, columns_of, is_own, own_columns
from mjnav.study.store import COLUMN as OWN_COLUMN

if TYPE_CHECKING:
    import pyarrow

# -------------------------------------------------------------------------------------------- figures


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


# --------------------------------------------------------------------------------------- rows by cell


CellPlace = tuple[str, str, str]  # scene, setting and method


@dataclass(frozen=True)
class CellRows:
    """The rows of one cell by seed: columns of numbers as arrays (n,), null as NaN; texts as arrays (n,) of objects."""

    scene: str
    setting: str
    method: str
    columns: Mapping[str, Array]
    texts: Mapping[str, NDArray[np.object_]] = field(default_factory=dict)
    units: NDArray[np.intp] | None = None  # (n,): rows of one unit of evidence share a number; None: each is its own
    num_missing: int = 0  # seeds of the study that have no row

    @property
    def place(self) -> CellPlace:
        """Scene, setting and method."""
        return self.scene, self.setting, self.method

    @property
    def seeds(self) -> Array:
        """Ascending, (n,)."""
        return self.columns["seed"]

    @cached_property
    def collided(self) -> Array:
        """Whether the robot touched anything, (n,); NaN for a failed episode."""
        return np.where(self.failed, np.nan, sum(self.columns[name] for name in COLLISIONS) > 0)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which episodes have no result, (n,)."""
        return np.isnan(self.columns["success"])

    def values(self, figure: str) -> Array:
        """A figure by seed, (n,); NaN where the seed does not count."""
        if figure == "collision":
            return self.collided
        if figure in HAPPENED:
            counts = sum(self.columns[name] for name in HAPPENED[figure])
            return np.where(np.isnan(counts), np.nan, counts > 0)
        values = self.columns[figure]
        return values if over_all(figure) else np.where(self.columns["success"] == 1, values, np.nan)

    def distinct(self, text: str) -> tuple[str, ...]:
        """The values of a column of texts, each once; none where it is not known."""
        return tuple(sorted({value for value in self.texts.get(text, ()) if value is not None}))

    def taken(self, rows: NDArray[np.intp]) -> "CellRows":
        """The cell with some of its rows."""
        columns, texts = ({key: c[rows] for key, c in table.items()} for table in (self.columns, self.texts))
        return replace(self, columns=columns, texts=texts, units=self.units_of(rows))

    def units_of(self, rows: NDArray[np.intp]) -> NDArray[np.intp] | None:
        """The units of some rows."""
        return None if self.units is None else self.units[rows]


def cell_rows(table: "pyarrow.Table", methods: Sequence[str] = ()) -> list[CellRows]:
    """The rows of a table by cell: sorted by scene and setting, then in the order of `methods`, labels without a grid.

    The column of users' own metrics becomes one column for each figure.
    """
    texts = [name for name in table.column_names if COLUMNS[name].type == STRING and name not in (*CELL, OWN_COLUMN)]
    numbers = [name for name in table.column_names if COLUMNS[name].type != STRING]
    columns = {name: table[name].cast("double").to_numpy(zero_copy_only=False) for name in numbers}
    columns["seed"] = table["seed"].to_numpy()
    if OWN_COLUMN in table.column_names:
        columns |= own_columns(table[OWN_COLUMN].to_pylist())
    of_text = {name: np.array(table[name].to_pylist(), dtype=object) for name in texts}
    labels = list(zip(*(table[name].to_pylist() for name in ("scene", "setting", "method")), strict=True))
    places: dict[CellPlace, list[int]] = {}
    for place in np.argsort(columns["seed"], kind="stable").tolist():
        places.setdefault(labels[place], []).append(place)

    def order(cell: CellPlace) -> tuple:
        scene, setting, method = cell
        known = [i for i, label in enumerate(methods) if method == label or method.startswith(f"{label} ")]
        return natural(scene), natural(setting), max(known, key=lambda i: len(methods[i]), default=0), natural(method)

    return [CellRows(*label, columns, of_text).taken(np.array(places[label])) for label in sorted(places, key=order)]


def natural(text: str) -> list[tuple[float, str]]:
    """A key by which weight=3.0 comes before weight=10.0."""
    parts = re.split(r"(\d+\.?\d*(?:e[+-]?\d+)?)", text)
    return [(float(part), "") if i % 2 else (0.0, part) for i, part in enumerate(parts)]


def pooled(cells: Sequence[CellRows], *, settings: bool = False) -> list[CellRows]:
    """One cell for each setting and method, with the rows of all scenes; with `settings` one for each method.

    Its seeds number (seed, setting, scene), so that a difference pairs the episodes of one scene, setting and seed.
    Scenes and settings count by the number of their episodes: alike, in a study that is complete. What several settings
    have of one layout is one unit of evidence; in a scene of one layout, what they have of one seed.
    """
    scenes = list(dict.fromkeys(cell.scene for cell in cells))
    labels = list(dict.fromkeys(cell.setting for cell in cells))
    settings = settings and len(labels) > 1
    groups: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        groups.setdefault((f"{len(labels)} settings" if settings else cell.setting, cell.method), []).append(cell)
    layouts = {name: {layout for c in cells if c.scene == name for layout in c.distinct(LAYOUT)} for name in scenes}
    drawn = {name for name in scenes if len(layouts[name]) > 1}
    joined = []
    for (setting, method), group in groups.items():
        columns = {key: np.concatenate([cell.columns[key] for cell in group]) for key in group[0].columns}
        columns["seed"] = np.concatenate(
            [
                (cell.seeds * len(labels) + labels.index(cell.setting)) * len(scenes) + scenes.index(cell.scene)
                for cell in group
            ]
        )
        texts = {
            PEOPLE: np.concatenate([cell.texts[PEOPLE] for cell in group]),
            LAYOUT: np.array([layout for cell in group for layout in _layouts(cell)], dtype=object),
        }
        order, units = np.argsort(columns["seed"]), None
        if settings:
            keys = [key for cell in group for key in _evidence(cell, drawn)]
            numbers = {key: number for number, key in enumerate(dict.fromkeys(keys[place] for place in order))}
            units = np.array([numbers[key] for key in keys])
        scene = scenes[0] if len(scenes) == 1 else f"{len(scenes)} scenes"
        cell = CellRows(scene, setting, method, columns, texts, units, sum(cell.num_missing for cell in group))
        joined.append(cell.taken(order))
    return joined


def _layouts(cell: CellRows) -> list[str | None]:
    """The layouts of a cell's rows under names that no other scene has; a scene that draws nothing has one."""
    draws = bool(cell.distinct(LAYOUT))
    return [None if draws and layout is None else f"{cell.scene} {layout}" for layout in cell.texts[LAYOUT]]


def _evidence(cell: CellRows, drawn: Collection[str]) -> list[str]:
    """What the rows of a unit of evidence share: the layout; in a scene of one, or where it is not known, the seed."""
    return [
        f"{cell.scene} {seed}" if layout is None or cell.scene not in drawn else f"{cell.scene}, {layout}"
        for seed, layout in zip(cell.seeds, cell.texts[LAYOUT], strict=True)
    ]

"""The rows of a sweep by cell: a scene under a setting and a method."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.study.compare.chosen_figures import COLLISIONS, HAPPENED, LAYOUT, PEOPLE, over_all
from mjnav.study.store.row import COLUMN as OWN_COLUMN
from mjnav.study.store.row import COLUMNS, STRING, own_columns

if TYPE_CHECKING:
    import pyarrow


@dataclass(frozen=True)
class CellRows:
    """The rows of one cell by seed: columns as arrays (n,), null as NaN."""

    scene: str
    setting: str
    method: str
    columns: Mapping[str, Array]
    people: tuple[str, ...] = ()  # the values of `PEOPLE`, each once; none where they are not known or nobody is there
    layouts: tuple[str, ...] = ()  # the values of `LAYOUT`, each once; none of a scene that draws nothing
    layout_by_row: tuple[str | None, ...] = ()  # the same row by row; () where it is not known
    units: NDArray[np.intp] | None = (
        None  # (n,) whole numbers: rows of one unit of evidence share one; None: each is its own
    )

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

    def units_of(self, places: NDArray[np.intp]) -> NDArray[np.intp] | None:
        """The units of some rows."""
        return None if self.units is None else self.units[places]

    def values(self, figure: str) -> Array:
        """A figure by seed, (n,); NaN where the seed does not count."""
        if figure == "collision":
            return self.collided
        if figure in HAPPENED:
            counts = sum(self.columns[name] for name in HAPPENED[figure])
            return np.where(np.isnan(counts), np.nan, counts > 0)
        values = self.columns[figure]
        if over_all(figure):
            return values
        return np.where(self.columns["success"] == 1, values, np.nan)


def cell_rows(table: "pyarrow.Table", methods: Sequence[str] = ()) -> list[CellRows]:
    """The rows of a table by cell: sorted by scene and setting, then in the order of `methods`, labels without a grid.

    Text columns other than the labels are left out; the column of users' own metrics becomes one for each figure.
    """
    names = [name for name in table.column_names if COLUMNS[name].type != STRING]
    columns = {name: table[name].cast("double").to_numpy(zero_copy_only=False) for name in names}
    columns["seed"] = table["seed"].to_numpy()
    if OWN_COLUMN in table.column_names:
        columns |= own_columns(table[OWN_COLUMN].to_pylist())
    labels = list(zip(*(table[name].to_pylist() for name in ("scene", "setting", "method")), strict=True))
    places: dict[tuple[str, str, str], list[int]] = {}
    for place in np.argsort(columns["seed"], kind="stable").tolist():
        places.setdefault(labels[place], []).append(place)

    def order(cell: tuple[str, str, str]) -> tuple:
        scene, setting, method = cell
        known = [i for i, label in enumerate(methods) if method == label or method.startswith(f"{label} ")]
        return natural(scene), natural(setting), max(known, key=lambda i: len(methods[i]), default=0), natural(method)

    def texts(column: str, places: Sequence[int]) -> tuple[str | None, ...]:
        return tuple(table[column].take(places).to_pylist()) if column in table.column_names else ()

    return [
        CellRows(
            *label,
            {name: column[places[label]] for name, column in columns.items()},
            people=_each_once(texts(PEOPLE, places[label])),
            layouts=_each_once(layouts := texts(LAYOUT, places[label])),
            layout_by_row=layouts,
        )
        for label in sorted(places, key=order)
    ]


def _each_once(values: Sequence[str | None]) -> tuple[str, ...]:
    return tuple(sorted({value for value in values if value is not None}))


def natural(text: str) -> list[tuple[float, str]]:
    """A key by which weight=3.0 comes before weight=10.0."""
    parts = re.split(r"(\d+\.?\d*(?:e[+-]?\d+)?)", text)
    return [(float(part), "") if i % 2 else (0.0, part) for i, part in enumerate(parts)]

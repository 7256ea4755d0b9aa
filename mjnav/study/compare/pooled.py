"""A study's scenes as one, or its scenes and settings: a layout is a draw, and pairs with the other methods' in it."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mjnav.study.compare.cell_rows import CellRows


def pooled(cells: Sequence[CellRows], *, settings: bool = False) -> list[CellRows]:
    """One cell for each setting and method, with the rows of all scenes; with `settings` one for each method.

    Its seeds number (seed, setting, scene), so that a difference pairs the episodes of one scene, setting and seed.
    Scenes and settings count by the number of their episodes: alike, in a study that is complete. What several settings
    have of one layout is one unit of evidence; in a scene of one layout, what they have of one seed.
    """
    scenes = list(dict.fromkeys(cell.scene for cell in cells))
    labels = list(dict.fromkeys(cell.setting for cell in cells))
    groups: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        groups.setdefault(("" if settings else cell.setting, cell.method), []).append(cell)
    if not settings or len(labels) == 1:
        return [_joined(group, scenes, labels) for group in groups.values()]
    drawn = {scene for scene in scenes if len({one for c in cells if c.scene == scene for one in c.layouts}) > 1}
    return [
        replace(_joined(group, scenes, labels, drawn), setting=f"{len(labels)} settings") for group in groups.values()
    ]


def _joined(
    cells: Sequence[CellRows], scenes: Sequence[str], labels: Sequence[str], drawn: Collection[str] | None = None
) -> CellRows:
    """The rows of all cells; with the scenes that draw several layouts, also their units of evidence."""
    columns = {key: np.concatenate([cell.columns[key] for cell in cells]) for key in cells[0].columns}
    places = [scenes.index(cell.scene) + len(scenes) * labels.index(cell.setting) for cell in cells]
    stride = len(scenes) * len(labels)
    columns["seed"] = np.concatenate([cell.seeds * stride + place for cell, place in zip(cells, places, strict=True)])
    order = np.argsort(columns["seed"])
    units = None
    if drawn is not None:
        keys = [key for cell in cells for key in _keys(cell, drawn)]
        numbers: dict[str, int] = {}
        units = np.array([numbers.setdefault(keys[place], len(numbers)) for place in order])
    return CellRows(
        scene=scenes[0] if len(scenes) == 1 else f"{len(scenes)} scenes",
        setting=cells[0].setting,
        method=cells[0].method,
        columns={key: column[order] for key, column in columns.items()},
        people=tuple(sorted({value for cell in cells for value in cell.people})),
        layouts=tuple(dict.fromkeys(f"{cell.scene} {layout}" for cell in cells for layout in cell.layouts or ("",))),
        units=units,
    )


def _keys(cell: CellRows, drawn: Collection[str]) -> Iterator[str]:
    """What the rows of a unit of evidence share: the layout; in a scene of one, or where it is not known, the seed."""
    layouts = cell.layout_by_row if cell.scene in drawn else [None] * len(cell.seeds)
    for seed, layout in zip(cell.seeds, layouts, strict=True):
        yield f"{cell.scene} {seed}" if layout is None else f"{cell.scene}, {layout}"

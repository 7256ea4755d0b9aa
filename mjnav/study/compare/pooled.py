"""The scenes of a study as one: every layout of every scene is a draw, and pairs with the other methods' in it."""

from collections.abc import Sequence

import numpy as np

from mjnav.study.compare.cell_rows import CellRows


def pooled(cells: Sequence[CellRows]) -> list[CellRows]:
    """One cell for each setting and method, with the rows of all scenes.

    Its seeds number (seed, scene), so that a difference pairs the episodes of one scene and seed. Scenes count by the
    number of their episodes: alike, in a study that is complete.
    """
    scenes = list(dict.fromkeys(cell.scene for cell in cells))
    name = scenes[0] if len(scenes) == 1 else f"{len(scenes)} scenes"
    groups: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        groups.setdefault((cell.setting, cell.method), []).append(cell)
    return [_joined(name, scenes, group) for group in groups.values()]


def _joined(name: str, scenes: Sequence[str], cells: Sequence[CellRows]) -> CellRows:
    columns = {key: np.concatenate([cell.columns[key] for cell in cells]) for key in cells[0].columns}
    columns["seed"] = np.concatenate([cell.seeds * len(scenes) + scenes.index(cell.scene) for cell in cells])
    order = np.argsort(columns["seed"])
    return CellRows(
        scene=name,
        setting=cells[0].setting,
        method=cells[0].method,
        columns={key: column[order] for key, column in columns.items()},
        people=tuple(sorted({value for cell in cells for value in cell.people})),
        layouts=tuple(f"{cell.scene} {layout}" for cell in cells for layout in cell.layouts or ("",)),
    )

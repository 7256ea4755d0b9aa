"""Cells of the items' studies that were never run."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from mjnav.study.cells import variants
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.store import FIGURES
from mjnav.study.study_file import load_study

NUM = 40
NOISE = np.random.default_rng(0).normal(scale=0.05, size=NUM)
Change = Callable[[str, str, str], Mapping[str, Any]]


def cell(method: str, *, scene: str = "crossing1", setting: str = "direct, physics.engine=kinematic", **columns: Any):
    """A cell of 40 seeds: figures are 1 or the number given, seed by seed a little different; counts are 0."""
    figures = {name: 1.0 + NOISE for name, column in FIGURES.items() if column.type == "double"}
    counts = {name: np.zeros(NUM) for name, column in FIGURES.items() if column.type == "int64"}
    given = {
        name: value + NOISE if name in figures and isinstance(value, float) else np.broadcast_to(value, NUM)
        for name, value in columns.items()
    }
    own = {"seed": np.arange(NUM), "success": np.ones(NUM), "ticks": np.full(NUM, 100.0)}
    return CellRows(scene, setting, method, {**figures, **counts, **own, **given})


@pytest.fixture(scope="session")
def made_up():
    return cell


@pytest.fixture(scope="session")
def cells_of():
    """All cells of an item's studies; `change` gives columns by scene, setting and method."""

    def cells(item, change: Change = lambda scene, setting, method: {}) -> list[CellRows]:
        found = []
        for study in map(load_study, item.studies):
            for variant in variants(study, study.scenes):
                place = (variant.scene, *variant.names)
                found.append(cell(place[2], scene=place[0], setting=place[1], **change(*place)))
        return found

    return cells

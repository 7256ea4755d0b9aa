"""The episodes of each cell that are worth a look: failed ones, collisions, timeouts, then the least clearance.

`run_commands` gives the command that repeats the episodes of a cell, which differ in their seed alone.
"""

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mjnav.messages import Array
from mjnav.study.cells import Variant, flat, variants
from mjnav.study.compare.chosen_figures import COLLISIONS
from mjnav.study.compare.study_comparison import CellPlace
from mjnav.study.store.store import MARK, Store
from mjnav.study.study_file import StudyFile


def run_commands(study: StudyFile, text: str) -> Mapping[CellPlace, str]:
    """`mjnav run ...` of every cell in a shipped scene, to which a seed is to be added: ` --seed 3`.

    `text` is the study file that the sweep left, whose first line is the sweep's command. Nothing that it names is
    opened: scenes that are given by path have no command.
    """
    given = list(_given(text))
    shipped = [scene for scene in study.scenes if "/" not in scene and not scene.endswith(".toml")]
    return {
        (variant.scene, *variant.names): shlex.join(_words(study, variant, given))
        for variant in variants(study, shipped)
    }


def _words(study: StudyFile, variant: Variant, given: Sequence[str]) -> Iterator[str]:
    yield from ("mjnav", "run", variant.scene, "--controller", variant.method.controller)
    for key, value in {**flat(study.set), **variant.overrides}.items():
        yield from ("--set", f"{key}={value if isinstance(value, str) else json.dumps(value)}")
    for override in given:
        yield from ("--set", override)


def _given(text: str) -> Iterator[str]:
    """What --set of the sweep's own command gave."""
    first = text.partition("\n")[0]
    try:
        words = shlex.split(first.removeprefix(MARK)) if first.startswith(MARK) else []
    except ValueError:  # no command line
        return
    for option, value in pairwise(words):
        if option == "--set":
            yield value
    yield from (word.removeprefix("--set=") for word in words if word.startswith("--set="))


PER_CELL = 3
MAX_CAUSE = 120  # characters of why an episode failed
_COLUMNS = ("study", "scene", "setting", "method", "seed", "success", "outcome", "min_clearance_m", "error", "log")


@dataclass(frozen=True, slots=True)
class WorstSeed:
    """One episode."""

    seed: int
    why: str  # in a few words
    log: str | None  # as its row names it: a path below the folder of the results
    succeeded: bool


def worst_seeds(store: Store, study: str, *, per_cell: int = PER_CELL) -> Mapping[CellPlace, tuple[WorstSeed, ...]]:
    """The worst `per_cell` episodes of every cell of a study, the worst first.

    Raises MjnavError as `Store.rows` does.
    """
    table = store.rows([*_COLUMNS, *COLLISIONS])
    columns = {name: table[name].to_pylist() for name in ("study", "scene", "setting", "method")}
    success = table["success"].cast("double").to_numpy(zero_copy_only=False)
    clearance = table["min_clearance_m"].cast("double").to_numpy(zero_copy_only=False)
    hit = np.sum([table[name].cast("double").to_numpy(zero_copy_only=False) for name in COLLISIONS], axis=0) > 0
    found: dict[CellPlace, list[int]] = {}
    for place in np.lexsort((clearance, _severity(success, hit))).tolist():
        if columns["study"][place] == study:
            cell = (columns["scene"][place], columns["setting"][place], columns["method"][place])
            rows = found.setdefault(cell, [])
            if len(rows) < per_cell:
                rows.append(place)
    return {
        cell: tuple(_worst_seed(table.slice(row, 1).to_pylist()[0]) for row in rows) for cell, rows in found.items()
    }


def _severity(success: Array, hit: Array) -> Array:
    """0 of an episode without a result, 1 of a collision, 2 of another failure, 3 of a success."""
    return np.where(np.isnan(success), 0, np.where(hit, 1, np.where(success == 0, 2, 3)))


def _worst_seed(row: Mapping[str, Any]) -> WorstSeed:
    if row["error"] is not None:
        why = f"failed: {row['error'][:MAX_CAUSE]}"
    elif hits := [name.removeprefix("collisions_") for name in COLLISIONS if row[name]]:
        why = f"touched a {' and a '.join(hits)}"
    elif not row["success"]:
        why = row["outcome"] or "no success"
    elif row["min_clearance_m"] is None:
        why = "success"
    else:
        why = f"success, least clearance {row['min_clearance_m']:.2f} m"
    return WorstSeed(row["seed"], why, row["log"], bool(row["success"]))

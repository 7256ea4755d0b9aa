"""The episodes of each cell that are worth a look: failed ones, collisions, timeouts, then the least clearance.

`run_commands` gives the command that repeats the episodes of a cell, which differ in their seed alone.
"""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mjnav.scene.overrides import override_text
from mjnav.study.cells import variants
from mjnav.study.compare.cell_rows import COLLISIONS, CellPlace, CellRows, cell_rows
from mjnav.study.compare.study_comparison import rows_of
from mjnav.study.store import CELL, PLACE_IN_STUDY, Store
from mjnav.study.study_file import StudyFile, flat, shipped_scenes


def run_commands(study: StudyFile, store: Store, scenes: Mapping[str, str] | None = None) -> Mapping[CellPlace, str]:
    """`mjnav run ...` of every cell, to which a seed is to be added: ` --seed 3`.

    The scenes and values of the sweep's own command count, too. A controller is named as in the rows, where a file has
    its whole path. Nothing that the study names is opened: without `scenes`, the names as they are in rows to the
    paths, scenes that are given by path have no command.
    """
    given = store.swept_with("--set")
    scenes = scenes or {scene: scene for scene in shipped_scenes([*study.scenes, *store.swept_with("--scene")])}
    rows = store.count_by((*CELL, "controller"))
    controllers = {tuple(place): controller for name, *place, controller in rows if name == study.name}
    commands = {}
    for variant in variants(study, list(scenes)):
        values = {**flat(study.set), **variant.overrides}
        pairs = [override_text(key, value) for key, value in values.items()]
        place = variant.scene, *variant.names
        controller = controllers.get(place) or variant.method.controller
        words = ["mjnav", "run", scenes[variant.scene], "--controller", controller]
        for override in (*pairs, *given):
            words += ["--set", override]
        commands[place] = shlex.join(words)
    return commands


PER_CELL = 3
MAX_CAUSE = 120  # characters of why an episode failed


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
    columns = (*PLACE_IN_STUDY, "success", "outcome", "min_clearance_m", "error", "log", *COLLISIONS)
    worst = {}
    for cell in cell_rows(rows_of(store.rows(columns), study)):
        success = cell.columns["success"]
        severity = np.where(cell.failed, 0, np.where(cell.collided == 1, 1, np.where(success == 0, 2, 3)))
        order = np.lexsort((cell.columns["min_clearance_m"], severity))
        worst[cell.place] = tuple(_worst_seed(cell, row) for row in order[:per_cell].tolist())
    return worst


def _worst_seed(cell: CellRows, row: int) -> WorstSeed:
    error, outcome, log = (cell.texts[name][row] for name in ("error", "outcome", "log"))
    touched = [name.removeprefix("collisions_") for name in COLLISIONS if cell.columns[name][row] > 0]
    succeeded, clearance = bool(cell.columns["success"][row] == 1), cell.columns["min_clearance_m"][row]
    if error is not None:
        why = f"failed: {error[:MAX_CAUSE]}"
    elif touched:
        why = f"touched a {' and a '.join(touched)}"
    elif not succeeded:
        why = outcome or "no success"
    else:
        why = "success" if np.isnan(clearance) else f"success, least clearance {clearance:.2f} m"
    return WorstSeed(int(cell.seeds[row]), why, log, succeeded)

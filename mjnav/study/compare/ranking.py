"""Which of its settings each method of a study does best with, by one number that is stated before the study is run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mjnav.errors import InputError
from mjnav.messages import Array
from mjnav.scene.toml import parse, value_text
from mjnav.study.cells import Variant, variants
from mjnav.study.compare.cell_rows import CellRows, cell_rows
from mjnav.study.compare.estimates import Estimate, bootstrap, estimate
from mjnav.study.compare.study_comparison import NEEDED, cells_of, check_distinct, rows_of
from mjnav.study.store import Store
from mjnav.study.study_file import StudyFile

TIME_WEIGHT, CONTROL_WEIGHT, CONTACT = 0.5, 0.1, -3.0  # a contact in a hundred counts as much as a fifth of the time
RULE = (
    f"score of an episode: 1 - {TIME_WEIGHT:g} time / time_limit - {CONTROL_WEIGHT:g} control cost / the scene's, at "
    f"least 0, where the goal is reached without contact; {CONTACT:g} after a contact or a fault; otherwise 0. The "
    "scene's is the median of all successes there. The mean is over the episodes of all scenes"
)
World = tuple[str, str]  # scene and setting
_FIGURES = ("success", "collision", "time_s", "control_cost")


@dataclass(frozen=True, slots=True)
class RankedSetting:
    """A setting of a method and how it did, all scenes together."""

    label: str  # "rkhs #7"
    values: Mapping[str, object]  # of the grid or the search, by key as a method's `set` takes them
    toml: str  # `set = { ... }` of a study's method that has this setting
    episodes: int
    failed: int  # of them, those without a result
    score: Estimate
    figures: Mapping[str, Estimate]  # rates of success and collision; time [s] and control cost of the successes
    scores: Array = field(compare=False, repr=False)  # (n,) of every episode, scene by scene and seed by seed


@dataclass(frozen=True, slots=True)
class MethodRanking:
    """A method's settings, the best first."""

    method: str
    shown: str  # what people read in its place
    controller: str
    settings: tuple[RankedSetting, ...]
    num_missing: int  # episodes of the study file that have no row


def rank(store: Store, study: StudyFile | None) -> tuple[MethodRanking, ...]:
    """The settings of every method of a study, by the mean score (`RULE`) with its bootstrap interval.

    Settings that score the same stand in the order of the study file. Raises InputError where there are no rows of the
    study, and without a study file, which says what the settings are.
    """
    if study is None:
        raise InputError(f"{store.folder}: no study file is kept there, which says what the settings are")
    table = rows_of(store.rows([*NEEDED, "time_s", "control_cost"]), study.name)
    if not table.num_rows:
        raise InputError(f"{store.folder}: no rows of study {study.name!r}")
    cells = cell_rows(table)
    check_distinct(cells, store)
    worlds = _worlds(cells, _time_limits(store, study))
    seeds, places = np.array(study.all_seeds), cells_of(store, study, cells)
    done = {cell.place: len(np.intersect1d(seeds, cell.seeds)) for cell in cells}
    by_method: dict[str, list[CellRows]] = {}
    for cell in cells:
        by_method.setdefault(cell.method, []).append(cell)
    rankings: list[MethodRanking] = []
    for method in study.methods:
        own = {v.names[1]: v for v in variants(study, ["any"]) if v.method is method}
        ranked = [_ranked(own[name], by_method[name], worlds) for name in own if name in by_method]
        ranked.sort(key=lambda setting: -setting.score.value)
        missing = sum(len(seeds) - done.get(place, 0) for place in places if place[2] in own)
        rankings.append(MethodRanking(method.identifier, method.shown, method.controller, tuple(ranked), missing))
    return tuple(rankings)


def scores(cell: CellRows, time_limit: float, usual_control: float) -> Array:
    """Of every episode of a cell, (n,), by `RULE`."""
    columns = cell.columns
    value = (
        1.0 - TIME_WEIGHT * columns["time_s"] / time_limit - CONTROL_WEIGHT * columns["control_cost"] / usual_control
    )
    reached = np.where(cell.columns["success"] == 1, np.clip(value, 0.0, 1.0), 0.0)
    return np.where(cell.failed | (cell.collided > 0), CONTACT, reached)


def _ranked(variant: Variant, cells: Sequence[CellRows], worlds: Mapping[World, tuple[float, float]]) -> RankedSetting:
    own = np.concatenate([scores(cell, *worlds[cell.scene, cell.setting]) for cell in cells])
    columns = {key: np.concatenate([cell.columns[key] for cell in cells]) for key in cells[0].columns}
    together = CellRows("all scenes", "", cells[0].method, columns)
    values, pairs = (
        {key.removeprefix("control."): value for key, value in table.items()}
        for table in (variant.own, {**variant.method.values, **variant.own})
    )
    # By quantiles, as of a rate: most scores are alike, and a few are those of a contact.
    interval = bootstrap(len(own)).ratios(own[None], np.ones((1, len(own))), studentised=False)[0]
    return RankedSetting(
        label=variant.names[1],
        values=values,
        toml=f"set = {value_text(pairs)}",
        episodes=len(own),
        failed=int(together.failed.sum()),
        score=Estimate(float(own.mean()), interval, len(own)),
        figures={figure: estimate(together, figure) for figure in _FIGURES},
        scores=own,
    )


def _worlds(cells: Sequence[CellRows], limits: Mapping[World, float]) -> dict[World, tuple[float, float]]:
    """The time limit [s] of every scene and setting, and the median control cost of all successes there."""
    spent: dict[World, list[Array]] = {}
    for cell in cells:
        spent.setdefault((cell.scene, cell.setting), []).append(
            cell.columns["control_cost"][cell.columns["success"] == 1]
        )
    found = {world: np.concatenate(parts) for world, parts in spent.items()}
    usual = {world: float(np.median(cost)) if cost.size else 0.0 for world, cost in found.items()}
    return {world: (limits[world], usual[world] or 1.0) for world in found}


def _time_limits(store: Store, study: StudyFile) -> dict[World, float]:
    """The time limit [s] of every scene and setting."""
    found: dict[World, float] = {}
    for values in store.count_by(("study", "scene", "setting", "scenario")):
        name, scene, setting, document = (value or "" for value in values)
        if name == study.name and (scene, setting) not in found:
            found[scene, setting] = float(parse(document, store.folder.name)["time_limit"])
    return found

"""The episodes that the items rest on: what their studies share, the order in which they are run, and their rows.

All studies share one store and take turns, seed by seed: where a run is interrupted, every cell has as many episodes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.paper.item import Item, StudyItem
from mjnav.study.cells import Cell, resolve
from mjnav.study.compare.cell_rows import CellRows, cell_rows
from mjnav.study.compare.estimates import estimate
from mjnav.study.compare.study_comparison import check_distinct
from mjnav.study.store.row import COLUMNS, PLACE_IN_STUDY
from mjnav.study.store.store import Store
from mjnav.study.study_file import MethodEntry, Overrides, SeedRange, SettingEntry, StudyFile
from mjnav.study.trial import Trial

NUM_SEEDS = 200  # a cell, from 0 on
# The paper's samples: a reading less draws of its noise. Filtered ones are those of the particle filters.
ROBOT_DIRECT: Overrides = MappingProxyType({"estimation.robot.source": "direct"})
DIRECT: Overrides = MappingProxyType({**ROBOT_DIRECT, "estimation.obstacles.source": "direct"})
SAMPLES = (SettingEntry("direct", DIRECT), SettingEntry("filtered"))
# The paper's MATLAB setting is kinematic; MuJoCo has wheels, motors and contacts.
WORLDS: Overrides = MappingProxyType(
    {"physics.engine": ["kinematic", "mujoco"], "noise.profile": ["pearson", "bimodal"]}
)
# All with the same effort: of five values, the least control cost without a collision on the seeds of paper-tuning.
TUNED: Mapping[str, MethodEntry] = MappingProxyType(
    {
        "rkhs d=1": MethodEntry("rkhs", "rkhs d=1", {"degree": 1, "weight": 1.0}),
        "rkhs d=2": MethodEntry("rkhs", "rkhs d=2", {"degree": 2, "weight": 0.3}),
        "rkhs d=3": MethodEntry("rkhs", "rkhs d=3", {"degree": 3, "weight": 0.3}),
        "gaussian-linearised": MethodEntry("gaussian-linearised", set={"delta": 0.1}),
        "gaussian-moments": MethodEntry("gaussian-moments", set={"eta": 0.7}),
        "kld": MethodEntry("kld", set={"weight": 3.0}),
        "saa": MethodEntry("saa", set={"eta": 0.9}),
    }
)


def options(values: Overrides) -> tuple[str, ...]:
    """Values as `--set` takes them."""
    return tuple(f"{key}={value}" for key, value in values.items())


def study(
    name: str,
    scenes: Iterable[str],
    methods: Iterable[MethodEntry],
    *,
    settings: tuple[SettingEntry, ...] = SAMPLES,
    grid: Overrides = WORLDS,
    common: Overrides = MappingProxyType({}),
) -> StudyFile:
    """The study "paper-<name>", by default in every world with direct and with filtered samples."""
    return StudyFile(
        schema=1,
        name=f"paper-{name}",
        scenes=tuple(scenes),
        methods=tuple(methods),
        seeds=SeedRange(NUM_SEEDS),
        set=common,
        grid=grid,
        settings=settings,
        source=f"paper-{name}",
    )


@dataclass(frozen=True, slots=True)
class PaperStudy:
    """A study and its cells."""

    file: StudyFile
    cells: tuple[Cell, ...]

    @property
    def text(self) -> str:
        """What it varies, a line each."""
        file, seeds = self.file, self.file.all_seeds
        lines = [f"scenes: {', '.join(file.scenes)}; seeds {seeds[0]} to {seeds[-1]}; {_listed(file.set)}"]
        lines += [f"every combination of: {_listed(file.grid)}"] if file.grid else []
        lines += [f"setting {setting.name}: {_listed(setting.set)}" for setting in file.settings]
        lines += [f"method {m.identifier}: {m.controller}, {_listed({**m.set, **m.grid})}" for m in file.methods]
        return "\n".join(line.rstrip("; ,:") for line in lines)


def _listed(values: Overrides) -> str:
    return ", ".join(f"{key} = {value}" for key, value in values.items())


def studies(items: Iterable[Item], seeds: int | None = None) -> tuple[PaperStudy, ...]:
    """The studies of these items, each once, with `seeds` seeds in place of their own. Raises InvalidValue."""
    files = {file.name: file for item in items if isinstance(item, StudyItem) for file in item.studies}
    sized = [file if seeds is None else file.with_seeds(seeds) for file in files.values()]
    return tuple(PaperStudy(file, resolve(file)) for file in sized)


def trials(wanted: Sequence[PaperStudy]) -> list[Trial]:
    """Every cell's first seed, then every cell's second, ..."""
    most = max((len(study.file.all_seeds) for study in wanted), default=0)
    return [
        Trial(study.file.name, cell, study.file.all_seeds[k])
        for k in range(most)
        for study in wanted
        if k < len(study.file.all_seeds)
        for cell in study.cells
    ]


@dataclass(frozen=True, slots=True)
class ItemRows:
    """The rows that an item rests on, and what of them is missing."""

    studies: tuple[PaperStudy, ...]
    cells: list[CellRows]
    asked: int  # episodes of its studies
    absent: tuple[str, ...]  # cells without any row
    left_out: int  # rows of its studies under other scenarios or seeds than are asked for

    @property
    def num(self) -> int:
        """Episodes that were run, failed ones too."""
        return sum(len(cell.seeds) for cell in self.cells)

    @property
    def num_failed(self) -> int:
        """Of them, those without a result."""
        return sum(int(cell.failed.sum()) for cell in self.cells)

    def estimates(self) -> list[dict[str, Any]]:
        """Every numeric figure of every cell with its interval and number of seeds, one a row."""
        names = ["collision", *(name for name, column in COLUMNS.items() if column.type != "string" and name != "seed")]
        table = []
        for cell in self.cells:
            for name in names:
                e = estimate(cell, name)
                if e.num:
                    low, high = e.interval or (None, None)
                    place = {"scene": cell.scene, "setting": cell.setting, "method": cell.method}
                    table.append({**place, "figure": name, "mean": e.value, "low": low, "high": high, "seeds": e.num})
        return table


def rows(store: Store, wanted: Sequence[PaperStudy]) -> ItemRows:
    """The rows of these studies, of their present cells and seeds alone, methods in the studies' order.

    Raises InputError where a cell has a seed twice.
    """
    table = store.rows(list(COLUMNS))
    keys = list(zip(*(table[name].to_pylist() for name in (*PLACE_IN_STUDY, "scenario")), strict=True))
    table = table.drop_columns(["scenario"])
    found, absent, num_asked, left_out = [], [], 0, 0
    for study in wanted:
        name = study.file.name
        asked = {
            (*Trial(name, cell, seed).place, cell.document) for cell in study.cells for seed in study.file.all_seeds
        }
        cells = cell_rows(
            table.filter(np.array([key in asked for key in keys], bool)),
            [method.identifier for method in study.file.methods],
        )
        check_distinct(cells, store)
        there = {(cell.scene, cell.setting, cell.method) for cell in cells}
        found += cells
        absent += [cell.label for cell in study.cells if (cell.scene, cell.setting, cell.method) not in there]
        num_asked += len(asked)
        left_out += sum(key[0] == name and key not in asked for key in keys)
    return ItemRows(tuple(wanted), found, num_asked, tuple(absent), left_out)

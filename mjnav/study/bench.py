"""`mjnav bench`: suites that nobody tunes on, with the rows of every method in them, beside which others are put.

    runs/bench/suites.toml        the suites, each with a version, and the methods with their settings
    runs/bench/suites.parquet     their reference rows, with the digests of the suites that they were made in

A suite is a study without methods of its own. A method is paired with the reference rows by scene, setting and seed.
Rows of a suite of another version or digest are not compared.
"""

import hashlib
import io
import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from mjnav.errors import MjnavError, unknown_name
from mjnav.loop.prepare import load_scenario
from mjnav.loop.provenance import provenance, revision
from mjnav.scene.library import data_folder
from mjnav.scene.load import read_text
from mjnav.scene.toml import parse
from mjnav.settings import Length, Range, Settled, below, read_document
from mjnav.settings.plugins import placed
from mjnav.study.cells import Labels, resolve
from mjnav.study.compare.cell_rows import WIN_BY, CellRows, cell_rows, columns_for, pooled
from mjnav.study.compare.study_comparison import NEEDED, Comparison, StudyComparison, compare, rows_of
from mjnav.study.compare.worst_seeds import run_commands, worst_seeds
from mjnav.study.store import Store, parquet, schema
from mjnav.study.study_file import MethodEntry, Overrides, StudyFile, scene_paths, shipped_scenes
from mjnav.study.sweep.sweep import trials
from mjnav.study.trial import Trial

if TYPE_CHECKING:
    import pyarrow

BENCH, SUITES = "bench", "suites.toml"  # the folder below runs/, and its file
ALL = "all suites"
HERE = "here"  # follows the name of a shipped method that is run beside its own reference rows
FIGURES = (
    *("collision_moving", "collision_at_rest", "timeout", WIN_BY, "control_cost"),
    *("mean_deviation_m", "min_human_distance_m"),
)
COLUMNS = tuple(dict.fromkeys((*NEEDED, "outcome", *columns_for(FIGURES))))


@dataclass(frozen=True, kw_only=True)
class Suite(StudyFile):
    """A study without methods of its own."""

    schema: Annotated[int, Range(1, 1)] = 1
    methods: Annotated[tuple[MethodEntry, ...], Length(0, 0)] = ()
    version: Annotated[int, Range(1, 1000), "rows of another one are not compared"]

    def study(self, methods: Sequence[MethodEntry]) -> StudyFile:
        """The study of these methods in the suite."""
        own = {key.name: getattr(self, key.name) for key in fields(StudyFile)}
        return StudyFile(**{**own, "name": f"{BENCH} {self.name}", "methods": tuple(methods)})

    @cached_property
    def digest(self) -> str:
        """Of its worlds as they resolve now, with every default."""
        cells = resolve(self.study([MethodEntry("mean")]))
        return hashlib.sha256("\n".join(sorted(cell.document for cell in cells)).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Bench(Settled):
    """runs/bench/suites.toml, or a file of one's own."""

    schema: Annotated[int, Range(1, 1), "version of this format"]
    suites: Annotated[tuple[Suite, ...], Length(1, 100)]
    methods: Annotated[tuple[MethodEntry, ...], Length(0, 100), "of the reference; the shipped file's by default"] = ()
    set: Annotated[Overrides, "any keys of a run file, for all episodes"] = field(default_factory=dict)
    source: str = field(default="", compare=False)  # the file it came from

    @classmethod
    def load(cls, path: str | None = None) -> "Bench":
        """Of a file; the shipped one by default. Raises InvalidValue."""
        name = path or str(data_folder("runs") / BENCH / SUITES)
        with below(file=name):
            bench = read_document(cls, parse(read_text(name), name))
        suites = tuple(replace(s, set={**bench.set, **s.set}, source=name) for s in bench.suites)
        return replace(bench, suites=suites, methods=bench.methods or cls.load().methods, source=name)

    @property
    def parameters(self) -> str:
        """A digest of every parameter of the methods, defaults included, in all suites."""
        cells = [cell for suite in self.suites for cell in resolve(suite.study(self.methods))]
        return hashlib.sha256("\n".join(cell.control for cell in cells).encode()).hexdigest()

    @property
    def rows(self) -> Path:
        """The file of the reference rows, beside this one."""
        return Path(self.source).with_suffix(".parquet")

    def only(self, names: Sequence[str]) -> "Bench":
        """With these suites; with all where none is named. Raises InvalidValue for an unknown one."""
        known = {suite.name: suite for suite in self.suites}
        for name in names:
            if name not in known:
                raise unknown_name("--suite", name, known)
        return replace(self, suites=tuple(known[name] for name in dict.fromkeys(names))) if names else self

    def entry(self, controller: str, values: Overrides) -> MethodEntry:
        """A method to be put beside the reference: with these parameters, or of a reference method as it is there."""
        shipped = next((method for method in self.methods if method.identifier == controller), None)
        if shipped is None:
            return MethodEntry(placed(controller, os.getcwd()), controller, values, label=controller.rpartition(":")[2])
        return MethodEntry(shipped.controller, f"{controller} ({HERE})", {**shipped.set, **values})

    def trials(self, methods: Sequence[MethodEntry], seeds: Mapping[str, Sequence[int]]) -> list[Trial]:
        """Every suite's cells under its `seeds`; an unfinished run has done the same share of every suite."""
        found: list[tuple[float, Trial]] = []
        for suite in self.suites:
            if seeds[suite.name]:
                study = replace(suite.study(methods), seeds=tuple(seeds[suite.name]))
                wanted = trials(study, resolve(study))
                found += [(i / len(wanted), trial) for i, trial in enumerate(wanted)]
        return [trial for _, trial in sorted(found, key=lambda pair: pair[0])]


def share_of(seeds: Sequence[int], share: float) -> Sequence[int]:
    """The first of them, at least one of any."""
    return seeds[: ceil(share * len(seeds) - 1e-9)]


# ------------------------------------------------------------------------------------ reference rows


@dataclass(frozen=True)
class Reference:
    """The reference rows: `COLUMNS` of every episode, and what they were made with."""

    table: "pyarrow.Table"
    # "suites": name -> version and digest; "parameters": digest; the facts of `loop.provenance`, "revision"
    made: Mapping[str, Any]

    @classmethod
    def load(cls, file: Path) -> "Reference":
        """Of a file; none where there is no file. Raises MjnavError where it cannot be read."""
        if not file.is_file():
            return cls(schema().empty_table().select(COLUMNS), {"suites": {}})
        import pyarrow as pa

        try:
            table = parquet().read_table(file)
            return cls(table.select(COLUMNS), json.loads(table.schema.metadata[BENCH.encode()]))
        except (OSError, KeyError, TypeError, ValueError, pa.ArrowException) as error:
            raise MjnavError(f"{file}: cannot be read ({error})") from None

    @classmethod
    def of(cls, store: Store, bench: Bench) -> "Reference":
        """The rows of a store, of the seeds that every method has in every cell of a suite."""
        import pyarrow as pa

        found = cls(store.rows(COLUMNS).sort_by([(name, "ascending") for name in COLUMNS[:5]]), {})
        whole = [found.table.slice(0, 0)]
        for name, rows in found._studies.items():
            seeds = set(found.seeds(name))
            whole.append(rows.filter(pa.array([seed in seeds for seed in rows["seed"].to_pylist()])))
        made = {suite.name: {"version": suite.version, "digest": suite.digest} for suite in bench.suites}
        facts = provenance(bench.methods[0].controller, ())
        return cls(
            pa.concat_tables(whole), {"suites": made, "parameters": bench.parameters, "revision": revision(), **facts}
        )

    def content(self) -> bytes:
        """The file."""
        file = io.BytesIO()
        table = self.table.replace_schema_metadata({BENCH: json.dumps(self.made)})
        parquet().write_table(table, file, compression="zstd", compression_level=19)
        return file.getvalue()

    def differs(self, suite: Suite) -> str | None:
        """Why the rows of a suite cannot be compared with; None where they can."""
        made = self.made["suites"].get(suite.name)
        if made is None:
            return "there are no reference rows of it"
        if made["version"] != suite.version:
            return f"the reference rows are of version {made['version']}, this is {suite.version}"
        return None if made["digest"] == suite.digest else "the reference rows were made in other worlds"

    @cached_property
    def _studies(self) -> dict[str, "pyarrow.Table"]:
        return {name: rows_of(self.table, name) for name in self.table["study"].unique().to_pylist()}

    def rows(self, study: str) -> "pyarrow.Table":
        """Of a suite's study."""
        return self._studies.get(study, self.table.slice(0, 0))

    def seeds(self, study: str) -> list[int]:
        """Those that every cell and method has."""
        counts = Counter(self.rows(study)["seed"].to_pylist())
        return sorted(seed for seed, count in counts.items() if count == max(counts.values()))


# ---------------------------------------------------------------------------------------- comparison


def comparison(bench: Bench, reference: Reference, store: Store, methods: Sequence[MethodEntry]) -> StudyComparison:
    """A table over all suites, and one for each: `methods` by their rows in the store, and the reference methods.

    Of the reference only the episodes count that the first of `methods` has, too. All others differ from it; where
    there is none, from the first reference method.
    """
    labels = Labels.of(bench.suites[0].study([*methods, *bench.methods]))
    mine = [method.identifier for method in methods]
    names = [*mine, *(method.identifier for method in bench.methods)]
    found = store.rows((*COLUMNS, "error", "revision", "machine"))
    tables, joined = [], []
    for suite in bench.suites:
        rows = [rows_of(found, suite.study(methods or bench.methods).name).select(COLUMNS)] * bool(mine)
        rows += [reference.rows(suite.study(bench.methods).name)] * (reference.differs(suite) is None)
        cells = [part for table in rows for part in cell_rows(table, names) if part.method in names]
        cells = sorted(_paired(cells, mine), key=lambda cell: names.index(cell.method))
        joined += [replace(cell, scene=f"{suite.name} {cell.scene}") for cell in cells]
        tables += _pooled(cells, suite.name, f"version {suite.version}", labels)
    if len(bench.suites) > 1:
        tables = [*_pooled(joined, ALL, f"{len(bench.suites)} of them", labels), *tables]
    return StudyComparison(
        folder=str(store.folder), study=BENCH, figures=FIGURES, tables=tuple(tables), num_seeds=0, absent=(),
        causes=Counter(error for error in found["error"].to_pylist() if error is not None),
        revisions=tuple(sorted({*found["revision"].to_pylist(), *filter(None, [reference.made.get("revision")])})),
        machines=tuple(sorted(set(found["machine"].to_pylist()))), others=(), inconsistencies=(),
        ratios=True, overview=len(bench.suites) > 1,
    )  # fmt: skip


def _paired(cells: Sequence[CellRows], mine: Sequence[str]) -> Iterator[CellRows]:
    """The cells, those of other methods with the episodes alone that the first of `mine` has, too."""
    base = {(cell.scene, cell.setting): cell.seeds for cell in cells if cell.method in mine[:1]}
    for cell in cells:
        if not mine or cell.method in mine:
            yield cell
        elif (cell.scene, cell.setting) in base:
            yield cell.taken(np.flatnonzero(np.isin(cell.seeds, base[cell.scene, cell.setting])))


def _pooled(cells: Sequence[CellRows], scene: str, setting: str, labels: Labels) -> Iterator[Comparison]:
    """One table of all cells."""
    one = [replace(cell, scene=scene, setting=setting) for cell in pooled(cells, settings=True)] if cells else []
    return compare(one, figures=FIGURES, labels=labels)


def weakest(bench: Bench, store: Store, method: MethodEntry) -> Iterator[tuple[str, str, str]]:
    """Of every suite in which the method did not always succeed: its name, its worst episode, and what repeats that."""
    for suite in bench.suites:
        study = suite.study([method])
        shipped, paths = shipped_scenes(study.scenes), scene_paths(study)
        commands = run_commands(study, store, {p if p in shipped else load_scenario(p).name: p for p in paths})
        worst = [
            (seed, place)
            for place, (seed,) in worst_seeds(store, study.name, per_cell=1).items()
            if place in commands and place[2] == method.identifier and not seed.succeeded
        ]
        if worst:
            seed, place = min(worst, key=lambda found: not found[0].why.startswith("touched"))
            log = f"{place[0]}{seed.seed}.mcap"
            again = f"{commands[place]} --seed {seed.seed} --log {log}; mjnav report {log}"
            yield suite.name, f"{place[0]}, seed {seed.seed}: {seed.why}", again

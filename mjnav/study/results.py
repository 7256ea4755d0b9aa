"""`mjnav.sweep` and `mjnav.compare`: a study in, a folder of results out, and what two folders of them say.

Results are below runs/out, or in any folder, with the study file that their sweep left beside them.
"""

import os
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from mjnav.errors import InputError, unknown_name
from mjnav.log.read.tables import check_pandas
from mjnav.loop.prepare import OUT_FOLDER, check_functions
from mjnav.loop.supervision import MAX_SECONDS
from mjnav.output_files import path_text
from mjnav.scene.overrides import Overrides, override_text, overrides_of
from mjnav.scene.ranges import MAX_TIME
from mjnav.settings import Range, below, settled
from mjnav.study.cells import resolve
from mjnav.study.compare.before_after import BeforeAfter, before_after
from mjnav.study.compare.cell_rows import DEFAULT_FIGURES
from mjnav.study.compare.study_comparison import StudyComparison, compare_study
from mjnav.study.keep import NONE
from mjnav.study.store import STUDY_FILE, Row, Store
from mjnav.study.study_file import StudyFile, load_study, studies, study_text
from mjnav.study.sweep.schedulers import dask, local
from mjnav.study.sweep.sweep import SweepSummary, trials
from mjnav.study.sweep.sweep import sweep as sweep_trials

if TYPE_CHECKING:
    import pyarrow

PathText = str | os.PathLike[str]
Workers = Annotated[int, Range(1, 10_000, "processes")]
Seconds = Annotated[float, Range(0.0, MAX_TIME, "s", open_low=True, or_inf=True)]


def find_results(given: PathText) -> tuple[Store, StudyFile | None]:
    """The results of a study's name or file, or in a folder, and the study file where one was named.

    Raises InputError where there are none.
    """
    folder, study = _find(given)
    store = Store(folder)
    if not store.has_rows():
        raise InputError(f"{folder}: no results of a sweep" + f"; mjnav sweep {given} makes them" * bool(study))
    return store, study


def _find(given: PathText) -> tuple[Path, StudyFile | None]:
    name = path_text("study", given, "a study by name, a study file or a folder of results")
    if name.endswith(".toml") or (isinstance(given, str) and name in studies()):
        study = load_study(given)
        return OUT_FOLDER / study.name, study
    for folder in (Path(name), OUT_FOLDER / name):
        if os.path.isdir(folder):  # Path.is_dir raises for a name that is too long
            return folder, None
    if "/" in name:
        raise InputError(f"{name}: no such folder")
    folders = [folder.name for folder in OUT_FOLDER.glob("*") if folder.is_dir()]
    raise unknown_name("study", name, {*studies(), *folders}, also="a study file or a folder of results")


def kept_study(store: Store) -> StudyFile | None:
    """The study file that the last sweep left beside its results, if any. Raises InputError where it is not valid."""
    return load_study(store.folder / STUDY_FILE) if store.study() else None


def compare(
    results: PathText, after: PathText | None = None, *, figures: Sequence[str] = DEFAULT_FIGURES, **options: Any
) -> StudyComparison | BeforeAfter:
    """Compares the methods of one study's results, or two folders of results seed by seed.

    `results` and `after` are a study's name or file, whose results are below runs/out, or a folder. `figures` are
    names of columns of numbers, or of groups of them (`mjnav list metrics` has all), beside the rates of success and
    collision.

    The other options are of one study's results. `reference` is the name of the method that the others of a table are
    compared with, by default the first. `pool` makes one table for each setting, of the episodes of all scenes, and
    `pool_all` one of all episodes. `rivals` has the win ratio of every two methods, too.

    Raises InputError where there are no results, or none in common; InvalidValue for an unknown figure or reference;
    MjnavError for a damaged file.
    """
    store, study = find_results(results)
    if after is None:
        return compare_study(store, study or kept_study(store), figures=figures, **options)
    other, study = find_results(after)
    if study is None:
        with suppress(InputError):  # a file that cannot be read gives no labels
            study = kept_study(other)
    return before_after(store, other, figures=figures, study=study, **options)


@dataclass(frozen=True, slots=True)
class SweepResult:
    """The results of a study in a folder, and what this sweep added."""

    study: str
    folder: Path
    summary: SweepSummary

    @property
    def causes(self) -> Counter[str]:
        """The number of failed episodes by cause."""
        return Store(self.folder).causes()

    def rows(self, columns: Sequence[str] | None = None) -> "pyarrow.Table":
        """These columns of all rows, `mjnav.study.store.COLUMNS` by default, in no particular order."""
        return Store(self.folder).rows(columns)

    def table(self, columns: Sequence[str] | None = None) -> Any:
        """The same as a DataFrame of pandas. Raises InputError where pandas is missing."""
        check_pandas()
        return self.rows(columns).to_pandas()

    def __repr__(self) -> str:
        s = self.summary
        return (
            f"SweepResult({self.study!r} in {str(self.folder)!r}: {s.kept + s.run} of {s.episodes} episodes, "
            f"{s.failed} failed)"
        )

    def compare(self, *, reference: str | None = None, figures: Sequence[str] = DEFAULT_FIGURES) -> StudyComparison:
        """The methods in tables, as `mjnav.compare` gives them."""
        return compare_study(Store(self.folder), kept_study(Store(self.folder)), reference=reference, figures=figures)


def sweep(
    study: StudyFile | str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    seeds: int | None = None,
    scenes: Sequence[str] = (),
    overrides: Overrides = (),
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    accept_changed: bool = False,
    keep_logs: str = NONE,
    max_seconds: float = MAX_SECONDS,
    stop: Callable[[], bool] = lambda: False,
    progress: Callable[[int, Row], None] = lambda done, row: None,
    tell: Callable[[str], None] = lambda text: None,
) -> SweepResult:
    """Runs a study's episodes in processes of this machine or on a Dask cluster; the rows go into a folder.

    `study` is a shipped study's name, the path of a study file or a StudyFile. `folder` is runs/out/<study's name> by
    default. `seeds` is their number, from the study's first on; `scenes` replace the study's; `overrides` are values
    for all episodes as `load_scenario` takes them. `workers` is the number of processes, one per processor by default;
    `scheduler` the address of a Dask scheduler in their place. A folder that has results is refused, unless `resume`
    adds what is missing or `retry_failed` runs failed episodes again, too; `accept_changed` adds also where scenes,
    sources or programs have changed. `keep_logs` is "none", "failures" or "all". An episode that takes more than
    `max_seconds` of wall time has failed. `stop` is asked after every episode whether to end, and `progress` gets the
    number of episodes that were run and the latest row; `tell` gets a line about an episode that makes no progress.

    Raises InputError before anything starts where something cannot be used; MjnavError where the disk refuses or the
    scheduler is lost: the rows of finished episodes are kept.
    """
    study = study if isinstance(study, StudyFile) else load_study(study)
    if seeds is not None:
        study = study.with_seeds(seeds)
    given = tuple(overrides_of(overrides))
    words = [f"--scene={scene}" for scene in scenes]
    words += [f"--set={override_text(one.key, one.value)}" for one in given]
    store = Store(OUT_FOLDER / study.name if folder is None else path_text("folder", folder))
    with below("workers"):
        num = len(os.sched_getaffinity(0)) if workers is None else settled(Workers, workers)
    with below("max_seconds"):
        max_seconds = settled(Seconds, max_seconds)
    check_functions(stop=stop, progress=progress, tell=tell)
    summary = sweep_trials(
        trials(study, resolve(study, given, scenes)),
        store,
        local(num, max_seconds, tell) if scheduler is None else dask(scheduler, max_seconds),
        text=f"# {shlex.join(['mjnav', 'sweep', study.name, *words])}\n{study_text(study)}",
        resume=resume,
        retry_failed=retry_failed,
        accept_changed=accept_changed,
        keep_logs=keep_logs,
        stop=stop,
        progress=progress,
    )
    return SweepResult(study.name, store.folder, summary)

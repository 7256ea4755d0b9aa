"""`mjnav.sweep`: a study in, a folder of results out."""

import json
import os
import shlex
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from mjnav.log.read.data_frame import check_pandas
from mjnav.loop.prepare import check_functions
from mjnav.loop.supervision import MAX_SECONDS
from mjnav.output_files import path_text
from mjnav.scene.overrides import Overrides, overrides_of
from mjnav.scene.ranges import MAX_TIME
from mjnav.settings import Range, below, settled
from mjnav.study.cells import resolve
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES
from mjnav.study.compare.study_comparison import StudyComparison, compare_study, html_table
from mjnav.study.keep import NONE
from mjnav.study.results import OUT_FOLDER, kept_study
from mjnav.study.store.row import Row
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile, load_study, study_text
from mjnav.study.sweep.schedulers import dask, local
from mjnav.study.sweep.sweep import SweepSummary, trials
from mjnav.study.sweep.sweep import sweep as sweep_trials

Workers = Annotated[int, Range(1, 10_000, "processes")]
Seconds = Annotated[float, Range(0.0, MAX_TIME, "s", open_low=True, or_inf=True)]
MAX_CAUSES = 5  # of failures that a notebook shows

if TYPE_CHECKING:
    import pyarrow


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
        """These columns of all rows, `mjnav.study.store.row.COLUMNS` by default, in no particular order."""
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

    def _repr_html_(self) -> str:
        """What was run, as notebooks show it."""
        s = self.summary
        rows = [
            ("episodes", f"{s.kept + s.run} of {s.episodes}"),
            ("of this sweep", f"{s.run} in {s.seconds:.1f} s"),
            ("failed", s.failed),
            *((cause, count) for cause, count in self.causes.most_common(MAX_CAUSES)),
        ]
        return html_table(f"{self.study} in {self.folder}", ("", ""), rows)

    def compare(self, *, reference: str | None = None, figures: Sequence[str] = DEFAULT_FIGURES) -> StudyComparison:
        """The methods in tables, as `mjnav.compare` gives them."""
        store = Store(self.folder)
        return compare_study(store, kept_study(store), reference=reference, figures=figures)


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
    words = [f"--set={one.key}={one.value if isinstance(one.value, str) else json.dumps(one.value)}" for one in given]
    wanted = trials(study, resolve(study, given, scenes))
    store = Store(OUT_FOLDER / study.name if folder is None else path_text("folder", folder))
    with below("workers"):
        num = len(os.sched_getaffinity(0)) if workers is None else settled(Workers, workers)
    with below("max_seconds"):
        max_seconds = settled(Seconds, max_seconds)
    check_functions(stop=stop, progress=progress, tell=tell)
    summary = sweep_trials(
        wanted,
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

"""Where the results of studies are, the study files that their sweeps left beside them, and `mjnav.compare` of them."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from mjnav.errors import InputError, unknown_name
from mjnav.loop.prepare import OUT_FOLDER
from mjnav.output_files import path_text
from mjnav.study.compare.before_after import BeforeAfter, before_after
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES
from mjnav.study.compare.study_comparison import StudyComparison, compare_study
from mjnav.study.store.store import STUDY_FILE, Store
from mjnav.study.study_file import StudyFile, load_study, studies

PathText = str | os.PathLike[str]


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
    `pool_all` one of all episodes. `win_by` is the cost that decides a pair of successes for the win ratio; `rivals`
    has it of every two methods, too.

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

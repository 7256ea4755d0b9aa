"""Where the results of studies are, and the study files that their sweeps left beside them."""

import os
from pathlib import Path

from mjnav.errors import InputError, unknown_name
from mjnav.output_files import path_text
from mjnav.study.store.store import STUDY_FILE, Store
from mjnav.study.study_file import StudyFile, load_study, studies

OUT_FOLDER = Path("runs/out")


def find_results(given: str | os.PathLike[str]) -> tuple[Store, StudyFile | None]:
    """The results of a study's name or file, or in a folder, and the study file where one was named.

    Raises InputError where there are none.
    """
    folder, study = _find(given)
    store = Store(folder)
    if not store.has_rows():
        raise InputError(f"{folder}: no results of a sweep" + f"; mjnav sweep {given} makes them" * bool(study))
    return store, study


def _find(given: str | os.PathLike[str]) -> tuple[Path, StudyFile | None]:
    name = path_text("study", given, "a study by name, a study file or a folder of results")
    if name.endswith(".toml") or (isinstance(given, str) and name in studies()):
        study = load_study(given)
        return OUT_FOLDER / study.name, study
    for folder in (Path(name), OUT_FOLDER / name):
        if os.path.isdir(folder):  # Path.is_dir raises for a name that is too long
            return folder, None
    if "/" in name:
        raise InputError(f"{name}: no such folder")
    there = [folder.name for folder in OUT_FOLDER.glob("*") if folder.is_dir()]
    raise unknown_name("study", name, {*studies(), *there}, also="a study file or a folder of results")


def kept_study(store: Store) -> StudyFile | None:
    """The study file that the last sweep left beside its results, if any. Raises InputError where it is not valid."""
    return load_study(store.folder / STUDY_FILE) if store.study() else None

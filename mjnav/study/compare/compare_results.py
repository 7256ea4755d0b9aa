"""`mjnav.compare`: the results of a study as tables, or two folders of results as what changed between them."""

import os
from collections.abc import Sequence
from contextlib import suppress
from typing import overload

from mjnav.errors import InputError
from mjnav.study.compare.before_after import BeforeAfter, before_after
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES, WIN_BY
from mjnav.study.compare.study_comparison import StudyComparison, compare_study
from mjnav.study.results import find_results, kept_study

PathText = str | os.PathLike[str]


@overload
def compare(
    results: PathText,
    after: None = None,
    *,
    reference: str | None = None,
    figures: Sequence[str] = DEFAULT_FIGURES,
    pool: bool = False,
    pool_all: bool = False,
    win_by: str = WIN_BY,
    rivals: bool = False,
) -> StudyComparison: ...
@overload
def compare(results: PathText, after: PathText, *, figures: Sequence[str] = DEFAULT_FIGURES) -> BeforeAfter: ...
def compare(
    results: PathText,
    after: PathText | None = None,
    *,
    reference: str | None = None,
    figures: Sequence[str] = DEFAULT_FIGURES,
    pool: bool = False,
    pool_all: bool = False,
    win_by: str = WIN_BY,
    rivals: bool = False,
) -> StudyComparison | BeforeAfter:
    """Compares the methods of one study's results, or two folders of results seed by seed.

    `results` and `after` are a study's name or file, whose results are below runs/out, or a folder. `figures` are
    names of columns of numbers, or of groups of them (`mjnav list metrics` has all), beside the rates of success and
    collision. `reference` is the label of the method that the others of a table are compared with, by default the
    first. `pool` makes one table for each setting, of the episodes of all scenes, and `pool_all` one of all episodes.
    `win_by` is the cost that decides a pair of successes for the win ratio; `rivals` has it of every two methods, too.

    Raises InputError where there are no results, or none in common; InvalidValue for an unknown figure or reference;
    MjnavError for a damaged file.
    """
    store, study = find_results(results)
    if after is not None:
        other, study = find_results(after)
        if study is None:
            with suppress(InputError):  # a file that cannot be read gives no labels
                study = kept_study(other)
        return before_after(store, other, figures=figures, study=study)
    return compare_study(
        store,
        study or kept_study(store),
        reference=reference,
        figures=figures,
        pool=pool,
        pool_all=pool_all,
        win_by=win_by,
        rivals=rivals,
    )

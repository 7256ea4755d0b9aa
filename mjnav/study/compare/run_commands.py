"""The command that repeats the episodes of a cell, which differ in their seed alone."""

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from mjnav.study.cells import Variant, flat, variants
from mjnav.study.compare.study_comparison import CellPlace
from mjnav.study.store.store import MARK
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

"""What a page says of a study beside its tables: how it was made, with which parameters, and its worst episodes."""

import json
import os
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from urllib.parse import quote

from mjnav.printable import printable
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.run_commands import run_commands
from mjnav.study.compare.study_comparison import CellPlace, StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed, worst_seeds
from mjnav.study.store.logs import kept_log
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile


@dataclass(frozen=True, slots=True)
class Background:
    """Facts about a folder of results; cells and methods stand under their labels."""

    folder: Path  # of the results
    page: Path  # the page's own path, from which links count
    made: str  # when the page was made, and by which version
    study_text: str  # the study file; "" where there is none
    parameters: Mapping[str, tuple[str, ...]]  # of the controller by method, as JSON; several where cells differ
    worst: Mapping[CellPlace, tuple[WorstSeed, ...]]
    commands: Mapping[CellPlace, str]  # that repeat an episode, but for its seed


def background(store: Store, study: StudyFile | None, results: StudyComparison, *, page: Path, made: str) -> Background:
    """What the store and the study file say. Raises MjnavError as `Store.rows` does."""
    text, labels = store.study(), results.labels
    parameters: dict[str, tuple[str, ...]] = {}
    for name, method, control in sorted(store.count_by(["study", "method", "control"]), key=str):
        if name == results.study and method is not None and control is not None:
            method = labels.methods.get(method, method)
            parameters[method] = (*parameters.get(method, ()), control)
    return Background(
        folder=store.folder,
        page=page,
        made=made,
        study_text=text,
        parameters=parameters,
        worst={labels.place(cell): seeds for cell, seeds in worst_seeds(store, results.study).items()},
        commands={labels.place(cell): c for cell, c in run_commands(study, text).items()} if study is not None else {},
    )


def parameters_html(found: Background) -> str:
    """The parameters of every method, and the study file."""
    rows = "".join(
        f'<tr><th scope="row">{_text(method)}</th><td>{"<br>".join(_text(_listed(text)) for text in texts)}</td></tr>'
        for method, texts in found.parameters.items()
    )
    head = '<thead><tr><th scope="col">method</th><th scope="col">parameters, with defaults</th></tr></thead>'
    table = f'<div class="wide"><table class="seeds">{head}<tbody>{rows}</tbody></table></div>' if rows else ""
    lines = "\n".join(map(printable, found.study_text.split("\n")))
    study = f"<details><summary>Study file</summary><pre>{escape(lines)}</pre></details>" if lines else ""
    return f"<details><summary>Parameters of the methods</summary>{table}</details>{study}"


def worst_html(found: Background, table: Comparison) -> str:
    """The worst seeds of every method of a table, each with its report or the command that makes one."""
    rows = "".join(
        f'<tr><th scope="row">{_text(row.method)}</th><td data-value="{seed.seed}">{seed.seed}</td>'
        f"<td>{_text(seed.why)}</td><td>{_way(found, (table.scene, table.setting, row.method), seed)}</td></tr>"
        for row in table.rows
        for seed in found.worst.get((table.scene, table.setting, row.method), ())
    )
    names = ("method", "seed", "what happened", "look at it")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    return (
        '<details><summary>Worst seeds of every method</summary><div class="wide"><table class="seeds sorted">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></details>"
        if rows
        else ""
    )


def _way(found: Background, cell: CellPlace, seed: WorstSeed) -> str:
    """A link to the report beside the log, or the commands that lead to one."""
    log = kept_log(found.folder, seed.log)
    if log is not None and (report := log.with_suffix(".html")).is_file():
        address = quote(os.path.relpath(report, found.page.parent))
        return f'<a href="./{escape(address)}">report</a>'
    if log is not None:
        return f"<code>mjnav report {_text(shlex.quote(str(log)))}</code>"
    if cell in found.commands:
        return f"<code>{_text(found.commands[cell])} --seed {seed.seed} --log seed{seed.seed}.mcap</code>"
    return ""


def _listed(text: str) -> str:
    """The values of a JSON object, name by name."""
    return ", ".join(_parts(text))


def _parts(text: str) -> Iterator[str]:
    try:
        document = json.loads(text)
    except ValueError:
        document = None
    if not isinstance(document, dict):
        yield text
        return
    yield from (f"{name} = {json.dumps(value)}" for name, value in document.items())


def _text(text: str) -> str:
    return escape(printable(text))

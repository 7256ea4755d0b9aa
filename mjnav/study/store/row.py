"""One episode as a row: every column of the store with its type and meaning, the same for all studies.

A figure that is undefined is null. A failed episode has no figures; its `error` says why.

The figures of users' own metrics share one column, `metrics`; tables name each of these figures by itself.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mjnav.errors import unknown_name
from mjnav.loop.provenance import FACTS
from mjnav.messages import Array
from mjnav.metrics import summary
from mjnav.metrics.definitions import INTEGER, NUMBER, STRING

COLUMN = "metrics"
_PREFIX = f"{COLUMN}_"


def figure_name(own: str) -> str:
    """The name of a metric's figure among all figures of a run: metrics_NAME."""
    return f"{_PREFIX}{own}"


def is_own(figure: str) -> bool:
    """Whether a figure is one of a user's own metrics, by its name."""
    return figure.startswith(_PREFIX)


def columns_of(figures: Iterable[str]) -> list[str]:
    """The columns of the store that hold these figures."""
    return list(dict.fromkeys(COLUMN if is_own(figure) else figure for figure in figures))


def own_columns(texts: Sequence[str | None]) -> dict[str, Array]:
    """Each figure of a column of JSON texts, by its name, as an array (n,); null and what is no number as NaN."""
    rows = [_figures(text) for text in texts]
    names = dict.fromkeys(name for row in rows for name in row)
    return {figure_name(name): np.array([_number(row.get(name)) for row in rows]) for name in names}


def check_own(figures: Iterable[str], known: Iterable[str]) -> None:
    """Raises InvalidValue for a figure of a user's own metric that no row has; `known` are names that rows have."""
    known = list(known)
    for figure in figures:
        if is_own(figure) and figure not in known:
            raise unknown_name("figure", figure, known)


def _figures(text: str | None) -> dict[str, Any]:
    """A row's figures. A shard may hold anything: what is no table of figures has none."""
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) and abs(value) < 1e300 else np.nan


ROW_SCHEMA = 2  # version of these columns; rows of version 1 do not have it

Value = str | int | float | bool | None


class Column(NamedTuple):
    """The type of a column, as Arrow calls it, and what it holds. A unit stands at the end of the column's name."""

    type: str
    text: str


def _columns(**columns: tuple[str, str]) -> Mapping[str, Column]:
    return MappingProxyType({name: Column(*column) for name, column in columns.items()})


LABELS = _columns(
    id=(STRING, "hash of the labels, the scenario, the parameters, the seed and all facts that decide the bits"),
    study=(STRING, "name in the study file"),
    scene=(STRING, "name of the scene"),
    setting=(STRING, "name of the setting and swept values of the study's grid; default without either"),
    method=(STRING, "name of the method and its swept values"),
    seed=(INTEGER, "seed of the episode"),
    controller=(STRING, "control.method"),
    parameters=(STRING, 'swept values by key as JSON: {"control.weight": 0.3}'),
    control=(STRING, "every parameter of the controller with its value, as JSON"),
    scenario=(STRING, "the run file with all defaults; `mjnav run` repeats the episode from it and the seed"),
)
FIGURES: Mapping[str, Column] = MappingProxyType(
    {
        "error": Column(STRING, "why there is no result, in a line; null where there is one"),
        **{name: Column(figure.type, figure.line) for name, figure in summary.FIGURES.items()},
    }
)
OWN = _columns(
    metrics=(STRING, "figures of the user's own metrics by name, as JSON; null where the scenario names none"),
)
ORIGIN = _columns(
    wall_s=(NUMBER, "wall time of the episode"),
    machine=(STRING, "host name"),
    revision=(STRING, "mjnav's version and git revision"),
    log=(STRING, "the episode's log as a path from the results' folder, logs/NAME.mcap; null where none was kept"),
)
# What decides an episode's bits beside its labels: column -> the fact of `loop.provenance` that it holds.
MADE_WITH: Mapping[str, str] = MappingProxyType({fact.replace(".", "_"): fact for fact in FACTS})
COLUMNS: Mapping[str, Column] = MappingProxyType(
    {
        **LABELS,
        **FIGURES,
        **OWN,
        **ORIGIN,
        "row_schema": Column(INTEGER, "version of these columns"),
        **{column: Column(STRING, FACTS[fact][1]) for column, fact in MADE_WITH.items()},
    }
)
CELL = ("study", "scene", "setting", "method")  # the labels that all rows of a cell share
PLACE_IN_STUDY = (*CELL, "seed")  # the labels of one episode


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode, on its way from the process that ran it to the store. `LABELS` and `ORIGIN` describe the fields."""

    id: str
    study: str
    scene: str
    setting: str
    method: str
    seed: int
    controller: str
    parameters: str
    control: str
    scenario: str
    machine: str
    revision: str
    wall_s: float | None
    made_with: Mapping[str, str]  # by fact of `loop.provenance`
    figures: Mapping[str, Value]  # by column of `FIGURES`; empty where there is an error
    error: str | None = None
    log: str | None = None
    metrics: str | None = None

    def values(self) -> dict[str, Value]:
        """The value of each of `COLUMNS`."""
        fields = {name: getattr(self, name) for name in (*LABELS, *OWN, *ORIGIN, "error")}
        facts = {column: self.made_with.get(fact) for column, fact in MADE_WITH.items()}
        return dict.fromkeys(COLUMNS) | dict(self.figures) | fields | facts | {"row_schema": ROW_SCHEMA}

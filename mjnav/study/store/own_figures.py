"""Figures of users' own metrics in the rows of a sweep: one column holds them all, and tables name them one by one."""

import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mjnav.errors import unknown_name
from mjnav.messages import Array

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

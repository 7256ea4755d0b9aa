"""Every figure with its unit, definition and source, from the one table of figures."""

from mjnav.metrics.definitions import TRUTH, Definition
from mjnav.metrics.summary import DERIVED, GROUPS

from .markdown import escape

_TITLES = {
    "ending": "Outcome",
    "path": "Path and clearance",
    "motion": "Motion",
    "social": "Effect on people",
    "decisions": "Decisions",
    "knowledge": "Estimation",
    "consistency": "Consistency of beliefs",
    "computing": "Computing time",
}
_HEAD = ["| name | unit | definition | better |", "|---|---|---|---|"]


def markdown() -> str:
    """A section with a table for each group, and one for what `compare` adds."""
    parts = []
    for group, figures in GROUPS.items():
        rows = [_row(name, one) for name, one in figures.items()]
        parts += [f"## {_TITLES[group]}", f"Group `{group}` of `mjnav compare --figure`.", "\n".join([*_HEAD, *rows])]
    rows = [_row(name, one) for name, one in DERIVED.items()]
    parts += ["## What `compare` adds", "\n".join([*_HEAD, *rows])]
    return "\n\n".join(parts)


def _row(name: str, one: Definition) -> str:
    text = escape(one.text) + (f": ${one.equation}$" if one.equation else "")
    text += f". Null: {escape(one.null)}" * bool(one.null) + f". *{escape(one.source)}*" * bool(one.source)
    unit = "yes, no" if one.type == TRUTH else one.unit
    return f"| `{name}` | {unit} | {text} | {one.better} |"

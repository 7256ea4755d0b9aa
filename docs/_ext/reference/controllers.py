"""The shipped methods, as the registry has them, with the parameters of each."""

from dataclasses import fields

from mjnav.control.registry import METHODS

from .markdown import escape


def markdown() -> str:
    """A table of the methods."""
    rows = [f"| `{m.name}` | {escape(m.idea)} | {escape(m.source)} | `mjnav/{m.file}` |" for m in METHODS.values()]
    table = ["| name | idea | source | file |", "|---|---|---|---|", *rows]
    own = [
        f"`{m.name}`\n: {', '.join(f'`{f.name}`' for f in fields(m.controller_class.parameters_type))}\n"
        for m in METHODS.values()
    ]
    return "\n".join([*table, "", "## Parameters that each method has", "", *own])

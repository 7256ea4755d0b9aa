"""Keys of a file as tables in Markdown."""

from collections.abc import Sequence

from mjnav.config.reference import KeyReference
from mjnav.scenarios.toml import value_text

from .markdown import escape

HEAD = "| key | type | allowed | default | meaning |\n|---|---|---|---|---|\n"


def by_table(rows: Sequence[KeyReference]) -> str:
    """A section for each table of a file: its top-level keys first, then `[robot]`, `[control]` and so on."""
    sections: dict[str, list[KeyReference]] = {"": []}
    for row in rows:
        top, dot, _ = row.key.partition(".")
        is_table = bool(dot) or any(other.key.startswith(f"{top}.") for other in rows)
        sections.setdefault(top if is_table else "", []).append(row)
    return "\n".join(_section(name, own) for name, own in sections.items() if own)


def _section(name: str, rows: Sequence[KeyReference]) -> str:
    title = f"`[{name}]`" if name else "Top of the file"
    return f"## {title}\n\n{HEAD}" + "\n".join(map(_row, rows)) + "\n"


def _row(row: KeyReference) -> str:
    default = "required" if row.required else "" if row.default is None else _code(value_text(row.default))
    allowed = f"{escape(row.allowed)} {row.unit}".strip()
    meaning = escape(row.description)
    if row.where:
        meaning = f"{meaning} ({escape(row.where)})".strip()
    return f"| `{row.key}` | {row.type} | {allowed} | {default} | {meaning} |"


def _code(text: str) -> str:
    return "`" + text.replace("|", "\\|") + "`" if text else ""

"""Keys of a file as lists in Markdown."""

from collections.abc import Sequence

from mjnav.scene.toml import value_text
from mjnav.settings.reference import KeyReference

from .markdown import escape


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
    return f"## {title}\n\n" + "\n".join(map(_entry, rows)) + "\n"


def _entry(row: KeyReference) -> str:
    """The key with its type, range, unit and default; below it the meaning."""
    facts = [f"{row.type} {escape(row.allowed)} {row.unit}".strip() if row.allowed or row.unit else row.type]
    if row.required:
        facts.append("required")
    elif row.default is not None:
        facts.append(f"default `{value_text(row.default)}`")
    meaning = escape(row.description)
    if row.where:
        meaning = f"{meaning} ({escape(row.where)})".strip()
    return f"`{row.key}` · {', '.join(facts)}\n: {meaning}\n"

"""Text of the code as Markdown."""

MARKS = "\\*_[]<>|$"


def escape(text: str) -> str:
    """Text in which Markdown finds no marks of its own but pairs of backticks."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return "\\`".join(map(_escaped, parts))
    return "`".join(part.replace("|", "\\|") if i % 2 else _escaped(part) for i, part in enumerate(parts))


def _escaped(text: str) -> str:
    for mark in MARKS:
        text = text.replace(mark, f"\\{mark}")
    return text

#!/usr/bin/env python3
"""Lists sentences of more than 35 words in README.md, CONTRIBUTING.md and docs/; exits with 1 where there are any.

Code blocks, tables, headings and directives are skipped. A formula is one word, and so is a piece of code.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST = 35  # words in a sentence
FENCE = re.compile(r"\s*(`{3,}|:{3,}|~{3,})")
SKIPPED = re.compile(r"\s*([|#]|\(.*\)=$|:[\w-]+:|!\[)|    (?!\s*([*-]|\d+\.) )")
ITEM = re.compile(r"\s*([*-]|\d+\.|>|:)\s")
ONE_WORD = re.compile(r"\$\$.*?\$\$|\$[^$]+\$|`+[^`]+`+|<?https?://\S+", re.DOTALL)
LINK = re.compile(r"!?\[([^]]*)\]\([^)]*\)")
ABBREVIATED = re.compile(r"\b(al|e\.g|i\.e|Fig|Eq|Sec|vs)\.")
END = re.compile(r"(?<=[.!?])[\"')*_]*\s+(?=[\"'(*_]*[A-Z0-9])")
WORD = re.compile(r"\w[\w'’.,/-]*")


def paragraphs(text: str) -> Iterator[tuple[int, str]]:
    """The first line's number and the text of each paragraph and list item that is prose."""
    fence, first, lines = "", 0, []
    for number, line in enumerate([*text.splitlines(), ""], 1):
        mark, item = FENCE.match(line), ITEM.match(line)
        if fence:
            fence = "" if mark and line.strip() == fence else fence
            continue
        ends = bool(mark) or not line.strip() or bool(item) or (not lines and bool(SKIPPED.match(line)))
        if ends and lines:
            yield first, "\n".join(lines)
            lines = []
        fence = mark[1] if mark else ""
        if mark or not line.strip() or (not lines and SKIPPED.match(line)):
            continue
        first = first if lines else number
        lines.append(line[item.end() :] if item else line)


def long_sentences(page: Path) -> Iterator[str]:
    """The sentences of a page that are too long, each behind its file, line and number of words."""
    for line, paragraph in paragraphs(page.read_text(encoding="utf-8")):
        plain = ABBREVIATED.sub(r"\1", LINK.sub(r"\1", ONE_WORD.sub("X", paragraph)))
        for sentence in END.split(plain):
            words = len(WORD.findall(sentence))
            if words > MOST:
                yield f"{page.relative_to(ROOT)}:{line}: {words} words: {' '.join(sentence.split())}"


if __name__ == "__main__":
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    found = [sentence for page in pages for sentence in long_sentences(page) if "_build" not in page.parts]
    print("\n".join(found) or f"no sentence has more than {MOST} words")
    sys.exit(bool(found))

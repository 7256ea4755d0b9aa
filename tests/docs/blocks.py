"""The code blocks of a page in Markdown, and what is done with each."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

CODE_BLOCK = re.compile(r"\{code-block\}\s*(\w*)")
INCLUDED = re.compile(r"\{literalinclude\}\s*(\S+)")
OPTION = re.compile(r":([\w-]+):\s*(.*)")


@dataclass(frozen=True)
class Block:
    """One fenced block: with a caption it is a file of that name; else bash and python are run, but for long ones.

    A file of the repository that a page includes is a block with a caption.
    """

    page: Path
    line: int  # of the page, where the code's first line stands; from 1
    language: str
    code: str
    caption: str = ""
    classes: str = ""

    @property
    def runs(self) -> bool:
        """Whether a test runs it."""
        return self.language in ("bash", "python") and not self.caption and "long" not in self.classes.split()

    def __str__(self) -> str:
        return f"{self.page}:{self.line}, {self.caption or self.language}"


def blocks_of(page: Path) -> list[Block]:
    """The blocks of a page in order, those inside notes, tabs and lists as well."""
    return list(_blocks(page, page.read_text(encoding="utf-8"), 0))


def _blocks(page: Path, text: str, before: int) -> Iterator[Block]:
    """The blocks of a text that begins after `before` lines of its page."""
    for token in MarkdownIt().parse(text.replace(":::", "```")):
        if token.type != "fence":
            continue
        assert token.map is not None
        first, words = before + token.map[0] + 1, token.info.strip()
        directive = CODE_BLOCK.match(words)
        if directive:
            options, code = _options(token.content)
            first += token.content[: len(token.content) - len(code)].count("\n")
            caption, classes = options.get("caption", ""), options.get("class", "")
            yield Block(page, first + 1, directive[1], code, caption, classes)
        elif included := INCLUDED.match(words):
            options, _ = _options(token.content)
            code = (page.parent / included[1]).read_text(encoding="utf-8")
            yield Block(page, first, options.get("language", "python"), code, options.get("caption", included[1]))
        elif words.startswith("{"):
            yield from _blocks(page, token.content, first)
        else:
            yield Block(page, first + 1, words.split(" ")[0], token.content)


def _options(content: str) -> tuple[dict[str, str], str]:
    """The options of a directive, and the code behind them."""
    options, lines = {}, content.splitlines(keepends=True)
    while lines and (option := OPTION.fullmatch(lines[0].strip())):
        options[option[1]] = option[2]
        lines.pop(0)
    while options and lines and not lines[0].strip():
        lines.pop(0)
    return options, "".join(lines)

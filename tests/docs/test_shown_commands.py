"""Every command and option that the documentation shows exists."""

import importlib.util
import re
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt

from mjnav.cli.main import COMMANDS
from mjnav.metrics.timing import LEAST_TICKS
from tests.docs.blocks import blocks_of
from tests.docs.test_pages import PAGES, ROOT

CALL = re.compile(r"(?:^|[;&|(`]\s*|\$ )(?:[\w./~-]*/|uv run )?mjnav ([a-z][a-z-]*)\b([^;&|\n`]*)", re.MULTILINE)


@cache
def options_of(command: str) -> frozenset[str]:
    import argparse

    parser = argparse.ArgumentParser()
    importlib.import_module(COMMANDS[command][0]).configure(parser)
    return frozenset(option for action in parser._actions for option in action.option_strings)


def calls(page: Path) -> list[tuple[str, str]]:
    """The commands that a page shows, in blocks and in its text, each with the words behind it."""
    inline = [
        child.content
        for token in MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8"))
        for child in token.children or ()
        if child.type == "code_inline"
    ]
    shown = [block.code for block in blocks_of(page) if block.language in ("bash", "console", "")]
    return [(call[1], call[2]) for text in [*shown, *inline] for call in CALL.finditer(text.replace("\\\n", " "))]


def test_shown_commands_and_options_exist():
    wrong = []
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES]:
        for command, words in calls(page):
            if command == "help":
                continue
            if command not in COMMANDS:
                wrong.append(f"{page.relative_to(ROOT)}: mjnav {command}")
                continue
            options = [
                word for word in re.findall(r"(?<![\w-])--?[a-z][a-z-]*", words) if word not in options_of(command)
            ]
            wrong += [f"{page.relative_to(ROOT)}: mjnav {command} {option}" for option in options]
    assert not wrong


def test_every_shown_rate_test_lasts_long_enough_for_a_verdict():
    shown = [words for page in PAGES for command, words in calls(page) if command == "rate-test"]
    timed = [re.search(r"--rate (\d+) --duration (\d+)", words) for words in shown]
    ticks = [int(found[1]) * int(found[2]) for found in timed if found is not None]
    assert ticks
    assert min(ticks) >= LEAST_TICKS

"""`mjnav report LOG...`: one HTML page that shows what happened in a run, or in several side by side."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from mjnav.errors import DamagedLogError, InputError, InvalidValue
from mjnav.output_files import output_path, replacement

MAX_STEM = 120  # characters of a page's name that is made of several logs' names


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("logs", metavar="LOG", nargs="+", help="the log of a run; of up to four, side by side")
    parser.add_argument("-o", "--output", metavar="FILE.html", help="where the page goes; beside the log by default")


def execute(arguments: argparse.Namespace) -> int:
    """Writes the page. Raises DamagedLogError after that where a log is damaged: the page has what is intact."""
    from mjnav.log.read.log import open_log
    from mjnav.report.run_page.of_logs import shown
    from mjnav.report.run_page.page import MAX_RUNS, page

    logs = [Path(log) for log in arguments.logs]
    if len(logs) > MAX_RUNS:
        raise InvalidValue("LOG", len(logs), f"1 to {MAX_RUNS} logs on a page")
    output = _output(arguments.output, logs)
    found = [shown(open_log(log, allow_damage=True)) for log in logs]
    text = page(found)
    replaced = output.exists()
    with replacement(output) as partial:
        partial.write_text(text, encoding="utf-8")
    print(f"{output}: {len(text.encode()) / 1000:.0f} kB{', replaced' if replaced else ''}")
    for inspection, _ in found:
        if inspection.damage is not None:
            raise DamagedLogError(f"{inspection.damage.error}; the page shows what is intact")
    return 0


def _output(given: str | None, logs: Sequence[Path]) -> Path:
    """Where the page goes. A name that nobody gave replaces nothing but a page."""
    if given is None:
        stem = "-".join(log.stem for log in logs)[:MAX_STEM]
        output = output_path("--output", logs[0].with_name(f"{stem}.html"), ".html")
        if output.exists() and not _is_page(output):
            raise InputError(f"{output}: exists, and is no page of mjnav's; name another with -o")
    else:
        output = output_path("--output", given, ".html", ".htm")
    for log in logs:
        if output.exists() and log.exists() and output.samefile(log):
            raise InvalidValue("--output", str(output), "another file than the log")
    return output


def _is_page(path: Path) -> bool:
    from mjnav.report.run_page.page import GENERATOR

    with open(path, "rb") as file:
        return f'content="{GENERATOR}"'.encode() in file.read(8192)

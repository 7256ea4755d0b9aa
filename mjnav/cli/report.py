"""`mjnav report LOG...`: one HTML page that shows what happened in a run, or in several side by side."""

import argparse
from pathlib import Path

from mjnav.errors import DamagedLogError, InputError

MAX_STEM = 120  # characters of a page's name that is made of several logs' names


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("logs", metavar="LOG", nargs="+", help="the log of a run; of up to four, side by side")
    parser.add_argument("-o", "--output", metavar="FILE.html", help="where the page goes; beside the log by default")


def execute(arguments: argparse.Namespace) -> int:
    """Writes the page. Raises DamagedLogError after that where a log is damaged: the page has what is intact."""
    from mjnav.log.read.log import open_log
    from mjnav.report.run_page.page import report

    logs = [open_log(log, allow_damage=True) for log in arguments.logs]
    output = Path(arguments.output) if arguments.output else _beside([Path(log) for log in arguments.logs])
    replaced = ", replaced" * output.exists()
    report(logs, output)
    print(f"{output}: {output.stat().st_size / 1000:.0f} kB{replaced}")
    for log in logs:
        if log.error is not None:
            raise DamagedLogError(f"{log.error}; the page shows what is intact")
    return 0


def _beside(logs: list[Path]) -> Path:
    """A page named after the logs. A name that nobody gave replaces nothing but a page."""
    from mjnav.report.run_page.page import GENERATOR

    output = logs[0].with_name("-".join(log.stem for log in logs)[:MAX_STEM] + ".html")
    if output.exists():
        with open(output, "rb") as file:
            if f'content="{GENERATOR}"'.encode() not in file.read(8192):
                raise InputError(f"{output}: exists, and is no page of mjnav's; name another with -o")
    return output

"""`mjnav export LOG --format FORMAT OUT`: a log as a folder that other programs read."""

import argparse

from mjnav.cli.options import check_needs
from mjnav.cli.terminal import answer, stoppable
from mjnav.errors import DamagedLogError
from mjnav.log import Log, open_log
from mjnav.log.export.export import FORMATS, check_format, check_new_folder, export

BY_TOPIC = tuple(name for name, form in FORMATS.items() if form.by_topic)


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="the log of a run")
    parser.add_argument("output", metavar="OUT", help="a folder that does not exist yet")
    parser.add_argument(
        "--format",
        metavar="|".join(FORMATS),
        required=True,
        help="a table a topic for pandas, or typed for DuckDB; a ROS 2 bag, which evo reads, too",
    )
    parser.add_argument(
        "--topic", action="append", metavar="NAME", help="csv, parquet: this topic only; may be repeated"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Writes the folder and prints what is in it."""
    form, topics = arguments.format, arguments.topic or ()
    check_format(form)
    check_needs("--topic", f"--format {' or '.join(BY_TOPIC)}", given=bool(topics), met=form in BY_TOPIC)
    check_format(form, topics)
    check_new_folder(arguments.output)
    log = _opened(arguments.log)
    with stoppable(form, log.duration or 0.0) as step:
        written = export(log, form, arguments.output, topics=topics, progress=step)
    of_export = log, form, arguments.output, written
    answer(arguments, _summary(*of_export), lambda: _print(*of_export))
    return 0


def _opened(path: str) -> Log:
    try:
        return open_log(path)
    except DamagedLogError as error:
        raise DamagedLogError(f"{error}\n`mjnav recover {path} OUT.mcap` saves what can be read") from None


def _summary(log: Log, form: str, output: str, written: dict[str, int]) -> dict:
    return {
        "format": form,
        "output": output,
        "complete": log.complete,
        "truncated": log.truncated,
        "duration_s": log.duration,
        "written": written,
    }


def _print(log: Log, form: str, output: str, written: dict[str, int]) -> None:
    print(f"{output}: {log.duration:.1f} s of simulated time")
    if log.truncated:
        print("  the log has no end, its writer was killed: this is what was written before")
    width = max(map(len, written), default=0)
    for name, count in written.items():
        print(f"  {name:{width}}  {count:8d} {FORMATS[form].counts}")

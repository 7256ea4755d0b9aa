"""`mjnav recover LOG OUT`: writes what is intact in a damaged log as a whole log."""

import argparse
from pathlib import Path

from mjnav.cli.terminal import answer, stoppable
from mjnav.log.recover import Recovery, recover

_SHOWN = 8  # damaged places
_MAX_TOPICS = 500  # listed
_MAX_WIDTH = 60  # [characters] that a short name is padded to, because of a long one


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="an MCAP file, damaged or not")
    parser.add_argument("out", metavar="OUT", help="the file to write, which does not exist yet")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Writes OUT and says what was kept and lost."""
    log = Path(arguments.log)
    size = 1e-6 * log.stat().st_size if log.exists() else 0.0
    with stoppable("recover", size, "MB") as step:
        recovery = recover(log, arguments.out, on_byte=lambda place: step(1e-6 * place))
    # changed_bit: earlier versions could put one changed bit right
    document = {"log": arguments.log, "out": arguments.out, "changed_bit": None, **recovery}
    answer(arguments, document, lambda: _print(recovery, arguments.out))
    return 0


def _print(found: Recovery, out: str) -> None:
    print(f"{out}: {_headline(found)}")
    topics = sorted(found["topics"].keys() | found["topics_lost"].keys())
    width = min(max(map(len, topics), default=0), _MAX_WIDTH)
    print(f"  {'messages':{width}}  {'kept':>8}  {'lost':>8}")
    for topic in topics[:_MAX_TOPICS]:
        lost = found["topics_lost"].get(topic, 0) if found["messages_lost_is_exact"] else "?"
        print(f"  {topic:{width}}  {found['topics'].get(topic, 0):8}  {lost:>8}")
    if len(topics) > _MAX_TOPICS:
        print(f"  {len(topics) - _MAX_TOPICS} topics more, which --json has")
    _print_names("attachments", found["attachments"], found["attachments_lost"])
    _print_names("metadata", found["metadata"], found["metadata_lost"])
    for gap in found["ranges"][:_SHOWN]:
        print(f"  damaged: bytes {gap['start']} to {gap['end']}, {gap['why']}")
    if found["num_ranges"] > _SHOWN:
        print(f"  damaged: {found['num_ranges'] - _SHOWN} places more")
    if found["unchecked"]:
        names = (name if count == 1 else f"{count} × {name}" for name, count in found["unchecked"].items())
        print(f"  kept, but no checksum covers it: {', '.join(names)}")
    if found["unknown_topics"]:
        print("  kept, but no record says their topics: the messages of /unknown/...")


def _print_names(what: str, kept: list[str], lost: list[str]) -> None:
    missing = f"; lost: {', '.join(lost)}" if lost else ""
    print(f"  {what}: {', '.join(kept) or 'none'}{missing}")


def _headline(found: Recovery) -> str:
    if found["how"] == "intact":
        return "the log is intact and was copied as it is; nothing was lost"
    lost = (
        f"{found['messages_lost'] or 'none'} lost"
        if found["messages_lost_is_exact"]
        else "how many were lost is not known"
    )
    return f"{found['messages']} messages kept, {lost}"

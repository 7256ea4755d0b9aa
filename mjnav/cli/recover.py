"""`mjnav recover LOG OUT`: what is intact in a damaged log, as a whole one."""

import argparse
import json
from pathlib import Path
from typing import Any

from mjnav.cli.interrupt import interruptible
from mjnav.cli.waiting import progress
from mjnav.recording.recover.recover import recover
from mjnav.recording.recover.recovery import Recovery

_SHOWN = 8  # damaged places
_MAX_TOPICS = 500  # listed
_MAX_WIDTH = 60  # [characters] that a short name is padded to, because of a long one


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("log", metavar="LOG", help="an MCAP file, damaged in whatever way")
    parser.add_argument("out", metavar="OUT", help="the file to write, which does not exist yet")
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Writes OUT and says what was kept and lost."""
    log = Path(arguments.log)
    size = 1e-6 * log.stat().st_size if log.exists() else 0.0
    with interruptible() as asked, progress("recover", size, "MB") as show:

        def step(place: int) -> None:
            if asked.is_set():
                raise KeyboardInterrupt
            show(1e-6 * place)

        recovery = recover(log, arguments.out, on_byte=step)
    if arguments.json:
        print(json.dumps({"schema": 1, "log": arguments.log, "out": arguments.out, **recovery.document()}))
    else:
        _print(recovery, arguments.out)
    return 0


def _print(recovery: Recovery, out: str) -> None:
    found = recovery.document()
    print(f"{out}: {_headline(recovery, found)}")
    topics = sorted(found["topics"].keys() | found["topics_lost"].keys())
    width = min(max(map(len, topics), default=0), _MAX_WIDTH)
    lost = "lost" if recovery.lost_is_exact else "lost, at least"
    print(f"  {'messages':{width}}  {'kept':>8}  {lost:>8}")
    for topic in topics[:_MAX_TOPICS]:
        kept, missing = (found[key].get(topic, 0) for key in ("topics", "topics_lost"))
        print(f"  {topic:{width}}  {kept:8}  {missing:{max(8, len(lost))}}")
    if len(topics) > _MAX_TOPICS:
        print(f"  {len(topics) - _MAX_TOPICS} topics more, which --json has")
    for what in ("attachments", "metadata"):
        missing = f"; lost: {', '.join(found[f'{what}_lost'])}" if found[f"{what}_lost"] else ""
        print(f"  {what}: {', '.join(found[what]) or 'none'}{missing}")
    for gap in found["ranges"][:_SHOWN]:
        print(f"  damaged: bytes {gap['start']} to {gap['end']}, {gap['why']}")
    if found["num_ranges"] > _SHOWN:
        print(f"  damaged: {found['num_ranges'] - _SHOWN} places more")
    if found["unchecked"]:
        names = (name if count == 1 else f"{count} × {name}" for name, count in found["unchecked"].items())
        print(f"  kept, but no checksum vouches for it: {', '.join(names)}")
    if found["unknown_topics"]:
        print("  kept, but nothing says of which topics they are: the messages of /unknown/...")


def _headline(recovery: Recovery, found: dict[str, Any]) -> str:
    if recovery.how == "intact":
        return "the log is intact and was copied as it is; nothing was lost"
    if recovery.how == "mended":
        place, bit = divmod(found["changed_bit"], 8)
        return f"bit {bit} of byte {place} was changed and is put right; nothing was lost"
    kept, lost = f"{found['messages']} messages kept", found["messages_lost"]
    if recovery.lost_is_exact or (not lost and not found["ranges"]):
        return f"{kept}, {lost or 'none'} lost"
    return f"{kept}, {f'at least {lost} lost' if lost else 'how many were lost is not known'}"

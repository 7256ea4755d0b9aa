"""Brings a log's messages to simulated time, where they are stamped with wall time, and to today's names of frames."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from mjnav.recording.encode.geometry import OLD_FRAMES
from mjnav.recording.log_format import FRAMES_KEY, epoch_ns

_FRAMES = ("frame_id", "parent_frame_id", "child_frame_id")


def adapter(run: Mapping[str, str] | None) -> Callable[[Any], None] | None:
    """What changes the messages of a log with this metadata mjnav/run in place; None where they are as they should."""
    epoch, old = epoch_ns(run), run is not None and FRAMES_KEY not in run
    if not epoch and not old:
        return None

    def adapt(value: Any) -> None:
        if isinstance(value, dict | bytes):
            return
        for part in _parts(value):
            names = part.DESCRIPTOR.fields_by_name
            if epoch and "timestamp" in names and part.HasField("timestamp"):
                part.timestamp.FromNanoseconds(part.timestamp.ToNanoseconds() - epoch)
            for name in _FRAMES if old else ():
                if name in names:
                    setattr(part, name, OLD_FRAMES.get(getattr(part, name), getattr(part, name)))

    return adapt


def _parts(value: Any) -> Iterator[Any]:
    """A Foxglove message, and the transforms or entities in it."""
    yield value
    yield from getattr(value, "transforms", ())
    yield from getattr(value, "entities", ())

"""A run that broke: the cause, where it happened, and the result of the ticks before."""

import traceback

from mjnav.errors import MjnavError
from mjnav.loop.faults.location import location
from mjnav.loop.result import Result
from mjnav.messages import Event

_MAX_TEXT = 300  # characters of an exception's message


class RunFault(MjnavError):
    """A fault ended a run: its outcome is `aborted`, its log is complete as far as the disk took it.

    `result` is that of the ticks before; None where they allow none.
    """

    def __init__(self, text: str, result: Result | None = None):
        super().__init__(text)
        self.result = result


def describe_fault(error: BaseException) -> str:
    """One line: mjnav's own words, or an exception's type, its message and the place in the user's code."""
    if isinstance(error, MjnavError):
        return _line(str(error))
    where = location(traceback.extract_tb(error.__traceback__))
    text = ": ".join(part for part in (type(error).__name__, _line(str(error))) if part)
    return f"{text} ({where})" if where else text


def fault_events(error: BaseException) -> tuple[Event, ...]:
    """The log's events about the error, with its traceback unless it is one of mjnav's own."""
    fault = Event("error", "fault", describe_fault(error))
    if isinstance(error, MjnavError):
        return (fault,)
    return fault, Event("info", "traceback", "".join(traceback.format_exception(error)))


def _line(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_TEXT else f"{text[:_MAX_TEXT]}..."

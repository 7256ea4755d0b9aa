"""A run that broke: the cause, where it happened, and the result of the ticks before."""

import traceback

from mjnav.errors import InvalidValue, MjnavError, PluginFault, message, said
from mjnav.loop.faults.location import location
from mjnav.loop.result import Result
from mjnav.messages import Event


class RunFault(MjnavError):
    """A fault ended a run: its outcome is `aborted`, its log is complete as far as the disk took it.

    `result` is that of the ticks before; None where they allow none.
    """

    def __init__(self, text: str, result: Result | None = None):
        super().__init__(text)
        self.result = result


def describe_fault(error: BaseException) -> str:
    """One line: mjnav's own words, or an exception's type, its message and the place in the user's code.

    A value that is refused within a run came from there, too.
    """
    if isinstance(error, MjnavError) and not isinstance(error, InvalidValue):
        return message(error)
    where = location(traceback.extract_tb(error.__traceback__))
    return f"{said(error)} ({where})" if where else said(error)


def fault_events(error: BaseException) -> tuple[Event, ...]:
    """The log's events about the error, with the traceback of code that is not mjnav's own."""
    fault = Event("error", "fault", describe_fault(error))
    raised = error.__cause__ if isinstance(error, PluginFault) else error
    if raised is None or isinstance(raised, MjnavError):
        return (fault,)
    return fault, Event("info", "traceback", "".join(traceback.format_exception(raised)))

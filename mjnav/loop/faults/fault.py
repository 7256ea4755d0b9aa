"""A run that broke: the cause, where it happened, and the result of the ticks before."""

import traceback

from mjnav.errors import InvalidValue, MjnavError, PluginFault, message, said
from mjnav.loop.faults.heartbeat import location
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

    A value that the user's code handed over and mjnav refused is told with that place, too.
    """
    ours = isinstance(error, MjnavError)
    if ours and not isinstance(error, InvalidValue):
        return message(error)
    where = location(traceback.extract_tb(error.__traceback__), users_only=ours)
    if where is None:
        return message(error) if ours else said(error)
    return f"{said(error)} ({where})"


def fault_events(error: BaseException) -> tuple[Event, ...]:
    """The log's events about the error, with the traceback of code that is not mjnav's own."""
    fault = Event("error", "fault", describe_fault(error))
    raised = error.__cause__ if isinstance(error, PluginFault) else error
    if raised is None or isinstance(raised, MjnavError):
        return (fault,)
    return fault, Event("info", "traceback", "".join(traceback.format_exception(raised)))

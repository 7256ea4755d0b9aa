"""What goes wrong with the messages of one sensor, or with the commands to the wheels."""

from collections import deque
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from mjnav.messages import Array
from mjnav.rng import stream
from mjnav.scenarios.faults import ChannelFaults


@dataclass(frozen=True, slots=True)
class Message:
    """What one message says, as rows of values that belong together: beams, people, or one row for all."""

    time: float  # [s] at which it was measured
    rows: Array  # (n, c)
    times: Array  # (n,) [s] of each row, where they have their own; else (0,)


class FaultyChannel:
    """The way of a channel's messages from the sensor to whoever hears them.

    On the way come, in this order: bias walk, outliers, stuck, NaN, late, repeated, dropout. Each kind draws from its
    own stream, "fault.<channel>.<kind>", as often whether it lasts or not, and whether there is a message or not.
    """

    def __init__(self, channel: str, faults: ChannelFaults, shape: tuple[int, int], seed: int):
        """`shape` is that of a message's rows."""
        self._faults, self._shape = faults, shape
        kinds = ("bias_walk", "outliers", "nan", "repeated", "dropout")
        self._streams = {k: stream(seed, f"fault.{channel}.{k}") for k in kinds if getattr(faults, k) is not None}
        self._bias = np.zeros(shape[1])
        self._walked = 0.0  # [s] until when the bias has walked
        self._measured: Array | None = None  # the rows of the latest message that was not stuck
        self._arriving: deque[Message] = deque()
        self._heard: Message | None = None

    def pass_on(self, time: float, message: Message | None) -> Message | None:
        """What is heard at `time` [s], where `message` was measured; None where nothing is."""
        message = self._repeated(time, self._late(time, self._with_nan(time, self._distorted(time, message))))
        lost = self._happens("dropout", time)
        if message is None or lost:
            return None
        self._heard = message
        return message

    def _distorted(self, time: float, message: Message | None) -> Message | None:
        error = self._walk(time) + self._outliers(time)
        if message is None:
            return None
        rows = message.rows + error if np.any(error) else message.rows
        if self._faults.stuck is not None:
            if self._faults.stuck.lasts(time) and self._measured is not None:
                rows = self._measured
            self._measured = rows
        return replace(message, rows=rows)

    def _walk(self, time: float) -> Array:
        """The bias of all rows, (c,)."""
        fault = self._faults.bias_walk
        if fault is None:
            return np.zeros(self._shape[1])
        step = self._streams["bias_walk"].standard_normal(self._shape[1])
        if not fault.lasts(time):
            return np.zeros(self._shape[1])
        self._bias = self._bias + fault.size * sqrt(max(time - max(self._walked, fault.start), 0.0)) * step
        self._walked = time
        return self._bias

    def _outliers(self, time: float) -> Array:
        """What rows are off by, (n, c), or (c,) zeros."""
        fault = self._faults.outliers
        if fault is None:
            return np.zeros(self._shape[1])
        draws = self._streams["outliers"].random((self._shape[0], 1 + self._shape[1]))
        if not fault.lasts(time):
            return np.zeros(self._shape[1])
        off = np.where(draws[:, 1:] < 0.5, -fault.size, fault.size)
        return np.where(draws[:, :1] < fault.share, off, 0.0)

    def _with_nan(self, time: float, message: Message | None) -> Message | None:
        if not self._happens("nan", time) or message is None:
            return message
        rows = message.rows.copy()
        rows[:, 0] = np.nan  # of detections x alone: a row of NaN says that nobody is there
        return replace(message, rows=rows)

    def _late(self, time: float, message: Message | None) -> Message | None:
        fault = self._faults.late
        if fault is None:
            return message
        if not fault.lasts(time):
            self._arriving.clear()
            return message
        if message is not None:
            self._arriving.append(message)
        arrived = None
        while self._arriving and self._arriving[0].time + fault.delay <= time + 1e-9:
            arrived = self._arriving.popleft()
        return arrived

    def _repeated(self, time: float, message: Message | None) -> Message | None:
        again = self._happens("repeated", time)
        return self._heard if again and message is not None and self._heard is not None else message

    def _happens(self, kind: str, time: float) -> bool:
        """Whether a fault that has a share strikes now; one draw in any case."""
        fault = getattr(self._faults, kind)
        if fault is None:
            return False
        draw = self._streams[kind].random()
        return fault.lasts(time) and draw < fault.share

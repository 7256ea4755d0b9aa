"""The live view of a run: a WebSocket server for Foxglove and Lichtblick, behind a front door (`front_door.py`).

`LiveServer` sends the bytes that go to the file, and drawings of the candidates beside them. Every client has a queue
in the server's own threads, which drops the oldest messages where that client is slow; the loop waits for no client.
"""

import os
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Self

from mcap.writer import Writer

from mjnav.errors import InputError, InvalidValue, of_extra
from mjnav.log.encode.topics import topics
from mjnav.scene.spec import Scenario

if TYPE_CHECKING:
    from foxglove import Channel
    from foxglove.websocket import WebSocketServer


PORT = 8765
LAST_MESSAGES = 0.2  # [s] that clients have to receive them before the server stops
STOP_TIMEOUT = 2.0  # [s] to wait for a client that receives nothing
_PORTS = range(65536)


class LiveServer:
    """Serves runs of `scenario`, one after another, on `port` of this machine; 0 chooses a free one.

    Connections are accepted from programs that are no browsers, and from pages of Foxglove, Lichtblick, this machine
    and `origins`; `refused` is called with the reason why another was refused. A context manager. Raises InputError
    where the port is in use, an origin is not valid or foxglove-sdk is not installed.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        port: int = PORT,
        origins: Sequence[str] = (),
        refused: Callable[[str], None] = lambda reason: None,
    ):
        from mjnav.log.front_door import HOST, FrontDoor, check_origin, hidden_address

        if port not in _PORTS:
            raise InvalidValue("port", port, f"a whole number from 0 to {_PORTS[-1]}")
        origins = [check_origin(origin) for origin in origins]
        with of_extra("foxglove-sdk", "live"):
            import foxglove
            from foxglove.websocket import Capability
        context = self._context = foxglove.Context()  # nothing else keeps a reference to it
        # Made before the server: a client might otherwise subscribe to a channel before the server knows it.
        self._channels = {
            topic.name: foxglove.Channel(
                topic.name,
                message_encoding=topic.schema.message_encoding,
                schema=foxglove.Schema(name=topic.schema.name, encoding=topic.schema.encoding, data=topic.schema.data),
                context=context,
            )
            for topic in topics(scenario)
        }
        self._served = False
        name = f"mjnav {scenario.name}, {scenario.control.method}, seed {scenario.seed}"
        # With this capability clients show simulated time, not the time of day.
        host = hidden_address()
        self._server = foxglove.start_server(
            name=name, host=host, port=0, context=context, capabilities=[Capability.Time]
        )
        try:
            self._door = FrontDoor(port, (host, self._server.port), origins, refused)
        except OSError as error:
            self._server.stop()
            reason = os.strerror(error.errno or 0)
            raise InputError(f"port {port} of {HOST} cannot be served: {reason}; choose another") from None
        self.url = f"ws://{HOST}:{self._door.port}"

    @property
    def watched(self) -> bool:
        """Whether any client subscribes to any topic."""
        return any(channel.has_sinks() for channel in self._channels.values())

    def writer(self, channels: Mapping[str, int], file: Writer | None, live_only: Collection[str] = ()) -> "LiveWriter":
        """Sends every message of a run to the clients before it goes to the file, if there is one.

        `channels` holds the number that messages bear for each topic; the topics in `live_only` do not go to the file.
        """
        if self._served:
            self._server.clear_session()  # simulated time starts at 0 again
        self._served = True
        clients = {number: self._channels[name] for name, number in channels.items()}
        return LiveWriter(self._server, clients, file, frozenset(channels[name] for name in live_only))

    def close(self) -> None:
        """Stops the server after its clients had time to receive the last messages."""
        if self.watched:
            time.sleep(LAST_MESSAGES)
        # `stop` waits for every client to receive what was sent, which a suspended one never does.
        stopping = threading.Thread(target=self._server.stop, daemon=True)
        stopping.start()
        stopping.join(STOP_TIMEOUT)
        self._door.close(STOP_TIMEOUT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class LiveWriter:
    """A `Writer` that sends to clients and writes to the file."""

    def __init__(
        self,
        server: "WebSocketServer",
        channels: Mapping[int, "Channel"],
        file: Writer | None,
        live_only: frozenset[int],
    ):
        self._server, self._channels, self._file, self._live_only = server, channels, file, live_only
        self._time_ns = -1

    def add_message(self, channel_id: int, log_time: int, data: bytes, publish_time: int, sequence: int = 0) -> None:
        """Sends and writes one message; times in simulated nanoseconds."""
        if log_time > self._time_ns:
            self._time_ns = log_time
            self._server.broadcast_time(log_time)
        self._channels[channel_id].log(data, log_time=log_time)
        if self._file is not None and channel_id not in self._live_only:
            self._file.add_message(channel_id, log_time, data, publish_time, sequence)

    def flush(self) -> None:
        """Writes all messages so far to the disk."""
        if self._file is not None:
            self._file.flush()

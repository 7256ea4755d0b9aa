"""The live view of a run: a WebSocket server for Foxglove and Lichtblick, protected from foreign web pages.

`FrontDoor` decides which connections are passed on to the server. Any page in a browser can open a WebSocket to this
machine, and foxglove-sdk does not check the origin. So its server listens at a random loopback address and port, one of
2^39, which no page can find by trying; the front door listens at the port to which users connect, reads each handshake,
and passes on the bytes of the connections that are allowed.

`LiveServer` sends the bytes that go to the file, and drawings of the candidates beside them. Every client has a queue
in the server's own threads, which drops the oldest messages where that client is slow; the loop waits for no client.
"""

import os
import re
import secrets
import selectors
import socket
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol, Self

from mjnav.errors import InputError, InvalidValue, missing_extra
from mjnav.log.encode.topics import topics
from mjnav.scene.spec import Scenario

if TYPE_CHECKING:
    from foxglove import Channel
    from foxglove.websocket import WebSocketServer


# -------------------------------------------------------------------------- protection from web pages


APPS = (
    "https://app.foxglove.dev",  # Foxglove's page since March 2024 (foxglove/studio #7528)
    "https://lichtblick-suite.github.io",  # Lichtblick's, below /lichtblick/
    # The desktop programs of both are Electron pages "served from file:// URLs" (StudioWindow.ts of foxglove/studio and
    # lichtblick-suite/lichtblick). A file that a browser shows says "null", and so does a foreign page's sandbox.
    "file://",
)
HOST = "127.0.0.1"  # this machine only: there is no password
HERE = (HOST, "localhost", "[::1]")
_ORIGIN = re.compile(r"https?://(?P<host>\[[0-9a-fA-F:.]+\]|[A-Za-z0-9.-]+)(:\d{1,5})?")
_MAX_HEAD = 16_384  # [bytes] of a handshake
_PATIENCE = 10.0  # [s] for the whole of one
_BLOCK = 1 << 18  # [bytes]
MAX_CONNECTIONS = 16  # at once: each costs a thread with its stack and block, and three file descriptors
_STACK = 1 << 19  # [bytes] of a thread: real-time runs lock them in memory, all 8 MiB of the system's usual ones
_PAUSE = 0.1  # [s] before the next attempt to accept, where the system has nothing left for a connection


def check_origin(origin: str) -> str:
    """An origin as browsers send it. Raises InvalidValue."""
    if not _ORIGIN.fullmatch(origin):
        raise InvalidValue("origin", origin, "scheme and host of a page, as in https://viewer.example.org:8080")
    return origin


def hidden_address() -> str:
    """A random loopback address."""
    return f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"


def why_refused(head: bytes, allowed: Collection[str]) -> str | None:
    """Why a request with this head is refused, in a line; None where it is allowed. Only browsers send an Origin."""
    try:
        request, headers = _parsed(head)
    except ValueError:
        return "this is not a WebSocket handshake"
    if not request.startswith("GET ") or headers.get("upgrade", "").lower() != "websocket":
        return "only WebSocket connections are served"
    name = re.sub(r":\d+$", "", headers.get("host", ""))
    if name not in HERE:
        return f"the host {name!r} is not this machine"
    origin = headers.get("origin")
    if origin is None or origin in allowed or origin in APPS:
        return None
    found = _ORIGIN.fullmatch(origin)
    return None if found and found["host"] in HERE else f"a page from {origin!r}: --allow-origin allows it"


def _parsed(head: bytes) -> tuple[str, Mapping[str, str]]:
    """The request line and the headers, each of which may occur once. Raises ValueError."""
    request, *lines = head.decode("latin-1").removesuffix("\r\n\r\n").split("\r\n")
    headers: dict[str, str] = {}
    for line in lines:
        name, colon, value = line.partition(":")
        name = name.lower()
        if not colon or name != name.strip() or name in headers:
            raise ValueError(line)
        headers[name] = value.strip()
    return request, headers


class FrontDoor:
    """Listens on `port` of this machine, 0 for any, and passes connections on to `behind`, an address and port.

    At most MAX_CONNECTIONS are open at once; further ones are closed. `refused` is called with the reason for each
    connection that is refused. Raises OSError where the port is in use.
    """

    def __init__(self, port: int, behind: tuple[str, int], allowed: Collection[str], refused: Callable[[str], None]):
        self._behind, self._allowed, self._refused = behind, frozenset(allowed), refused
        self._open: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._closing = threading.Event()
        self._listener = socket.create_server((HOST, port))
        self.port: int = self._listener.getsockname()[1]
        self._start(self._accept)

    def close(self, timeout: float) -> None:
        """Stops listening; waits at most `timeout` [s] for the server behind to end its connections."""
        self._closing.set()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in list(self._threads):
            thread.join(timeout)
            if thread.is_alive():
                timeout = 0.0
        for connection in list(self._open):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _start(self, function: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=function, args=arguments, name="mjnav-door", daemon=True)
        before = threading.stack_size(_STACK)
        try:
            thread.start()
        finally:
            threading.stack_size(before)
        self._threads = [*filter(threading.Thread.is_alive, self._threads), thread]

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:  # closed, or for example no file descriptor is free
                if self._closing.wait(_PAUSE):
                    return
                continue
            if len(self._open) >= MAX_CONNECTIONS:
                client.close()
                self._refused(f"more than {MAX_CONNECTIONS} connections at once")
                continue
            self._open.add(client)
            try:
                self._start(self._serve, client)
            except RuntimeError:  # the system starts no more threads
                self._end(client)

    def _serve(self, client: socket.socket) -> None:
        """One connection, from its handshake to its end."""
        try:
            head, rest = _head(client)
            reason = why_refused(head, self._allowed)
            if reason is not None:
                text = reason.encode()
                line = b"HTTP/1.1 403 Forbidden\r\nConnection: close\r\nContent-Type: text/plain\r\nContent-Length: "
                client.sendall(line + str(len(text)).encode() + b"\r\n\r\n" + text)
                self._refused(reason)
                return
            client.settimeout(None)
            with socket.create_connection(self._behind, timeout=_PATIENCE) as server:
                server.settimeout(None)
                for end in (client, server):
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                server.sendall(head + rest)
                _pass_on(client, server)
        except OSError:  # the connection is closed
            pass
        finally:
            self._end(client)

    def _end(self, client: socket.socket) -> None:
        self._open.discard(client)
        client.close()


def _head(client: socket.socket) -> tuple[bytes, bytes]:
    """The head of a request with its empty line, and the bytes after it.

    Raises OSError if no head arrives within _PATIENCE.
    """
    data, ends = b"", time.monotonic() + _PATIENCE
    while b"\r\n\r\n" not in data:
        client.settimeout(max(ends - time.monotonic(), 0.0))
        block = client.recv(4096)
        if not block or len(data) > _MAX_HEAD:
            raise ConnectionError("no handshake")
        data += block
    head, _, rest = data.partition(b"\r\n\r\n")
    return head + b"\r\n\r\n", rest


def _pass_on(client: socket.socket, server: socket.socket) -> None:
    """Copies bytes in both directions until both have ended. Raises OSError where a connection breaks."""
    block = bytearray(_BLOCK)
    view = memoryview(block)
    with selectors.PollSelector() as ready:
        for source, target in ((client, server), (server, client)):
            ready.register(source, selectors.EVENT_READ, (source, target))
        while ready.get_map():
            for key, _ in ready.select():
                source, target = key.data
                if size := source.recv_into(block):
                    target.sendall(view[:size])
                else:
                    ready.unregister(source)
                    target.shutdown(socket.SHUT_WR)


# --------------------------------------------------------------------------------------------- server


PORT = 8765
LAST_MESSAGES = 0.2  # [s] that clients have to receive them before the server stops
STOP_TIMEOUT = 2.0  # [s] to wait for a client that receives nothing
_PORTS = range(65536)


class Writer(Protocol):
    """Where messages are written: the file's `mcap.writer.Writer`, or an object that also sends them to clients."""

    def add_message(self, channel_id: int, log_time: int, data: bytes, publish_time: int, sequence: int = 0) -> None:
        """Writes one message; times in simulated nanoseconds."""
        ...

    def flush(self) -> None:
        """Writes all messages so far to the disk."""
        ...


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
        if port not in _PORTS:
            raise InvalidValue("port", port, f"a whole number from 0 to {_PORTS[-1]}")
        origins = [check_origin(origin) for origin in origins]
        try:
            import foxglove
            from foxglove.websocket import Capability
        except ImportError:
            raise missing_extra("foxglove-sdk", "live") from None
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

    def writer(self, channels: Mapping[str, int], file: Writer | None, live_only: Collection[str] = ()) -> Writer:
        """Sends every message of a run to the clients before it goes to the file, if there is one.

        `channels` holds the number that messages bear for each topic; the topics in `live_only` do not go to the file.
        """
        if self._served:
            self._server.clear_session()  # simulated time starts at 0 again
        self._served = True
        clients = {number: self._channels[name] for name, number in channels.items()}
        return _LiveWriter(self._server, clients, file, frozenset(channels[name] for name in live_only))

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


class _LiveWriter:
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
        """See `Writer`."""
        if log_time > self._time_ns:
            self._time_ns = log_time
            self._server.broadcast_time(log_time)
        self._channels[channel_id].log(data, log_time=log_time)
        if self._file is not None and channel_id not in self._live_only:
            self._file.add_message(channel_id, log_time, data, publish_time, sequence)

    def flush(self) -> None:
        """See `Writer`."""
        if self._file is not None:
            self._file.flush()

"""Decides which connections are passed on to the live server: none of a foreign web page.

Any page in a browser can open a WebSocket to this machine, and foxglove-sdk does not check the origin. So its server
listens at a random loopback address and port, one of 2^39, which no page can find by trying; the front door listens at
the port to which users connect, reads each handshake, and passes on the bytes of the connections that are allowed.
"""

import asyncio
import re
import secrets
import socket
import threading
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress

from mjnav.errors import InvalidValue

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
MAX_CONNECTIONS = 16  # at once: each costs a block and three file descriptors


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
    connection that is refused. Raises OSError where the port is in use. All connections are served by one thread, which
    starts here: before real-time scheduling, which it would inherit.
    """

    def __init__(self, port: int, behind: tuple[str, int], allowed: Collection[str], refused: Callable[[str], None]):
        self._behind, self._allowed, self._refused = behind, frozenset(allowed), refused
        self._open: set[asyncio.Task] = set()
        listener = socket.create_server((HOST, port))
        self.port: int = listener.getsockname()[1]
        self._loop = asyncio.new_event_loop()
        # asyncio goes on after an error of a connection, or where no file descriptor is free; it only reports it.
        self._loop.set_exception_handler(lambda loop, context: None)
        self._thread = threading.Thread(target=self._loop.run_forever, name="mjnav-door", daemon=True)
        self._thread.start()
        # On that thread: this one may be in an event loop already, as a notebook's is.
        starting = asyncio.start_server(self._serve, sock=listener, limit=_MAX_HEAD)
        self._server = asyncio.run_coroutine_threadsafe(starting, self._loop).result()

    def close(self, timeout: float) -> None:
        """Stops listening; waits at most `timeout` [s] for the server behind to end its connections."""
        if self._thread.is_alive():
            asyncio.run_coroutine_threadsafe(self._close(timeout), self._loop).result()
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._loop.close()

    async def _close(self, timeout: float) -> None:
        self._server.close()
        if self._open:
            _, remaining = await asyncio.wait(self._open, timeout=timeout)
            for task in remaining:
                task.cancel()
            await asyncio.gather(*remaining, return_exceptions=True)
        await asyncio.sleep(0)  # in which aborted connections end

    async def _serve(self, client: asyncio.StreamReader, answers: asyncio.StreamWriter) -> None:
        """One connection, from its handshake to its end."""
        task = asyncio.current_task()
        assert task is not None
        if len(self._open) >= MAX_CONNECTIONS:
            answers.close()
            self._refused(f"more than {MAX_CONNECTIONS} connections at once")
            return
        self._open.add(task)
        try:
            await self._answer(client, answers)
            answers.close()
            await answers.wait_closed()
        except (OSError, EOFError, asyncio.LimitOverrunError, asyncio.CancelledError):
            pass  # no handshake in time, or the connection is closed
        finally:
            answers.transport.abort()
            self._open.discard(task)

    async def _answer(self, client: asyncio.StreamReader, answers: asyncio.StreamWriter) -> None:
        async with asyncio.timeout(_PATIENCE):
            head = await client.readuntil(b"\r\n\r\n")
        if (reason := why_refused(head, self._allowed)) is not None:
            text = reason.encode()
            line = b"HTTP/1.1 403 Forbidden\r\nConnection: close\r\nContent-Type: text/plain\r\nContent-Length: "
            answers.write(line + str(len(text)).encode() + b"\r\n\r\n" + text)
            self._refused(reason)
            return
        async with asyncio.timeout(_PATIENCE):
            server, questions = await asyncio.open_connection(*self._behind, limit=_BLOCK)
        try:
            questions.write(head)
            await asyncio.gather(_pass_on(client, questions), _pass_on(server, answers))
        finally:
            questions.transport.abort()


async def _pass_on(source: asyncio.StreamReader, target: asyncio.StreamWriter) -> None:
    """Copies bytes until the source has ended or a connection breaks; the target is then told so."""
    with suppress(OSError):
        while block := await source.read(_BLOCK):
            target.write(block)
            await target.drain()
    with suppress(OSError):
        target.write_eof()

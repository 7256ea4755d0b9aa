"""A web page from elsewhere gets nothing from the live server; pages that may connect get all."""

import http.server
import os
import shutil
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from mjnav import load_scenario
from mjnav.errors import InvalidValue
from mjnav.log.front_door import why_refused
from mjnav.log.live import LiveServer
from tests.log.conftest import make_scenario

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
playwright = pytest.importorskip("playwright.sync_api")

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
# A name for every address: the page's server, and this machine by a name of the attacker's (DNS rebinding).
OPTIONS = ("--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP *.example 127.0.0.1")
PATIENCE = 30.0  # [s]
CONNECT = """([url, frame]) => new Promise((done) => {
    const script = `const socket = new WebSocket(${JSON.stringify(url)}, 'foxglove.sdk.v1');
        let heard = 0;
        socket.onmessage = () => { heard += 1; };
        socket.onerror = socket.onclose = () => tell(-1);
        setTimeout(() => tell(heard), 2000);`;
    if (!frame) { new Function('tell', script)(done); return; }
    window.onmessage = (message) => done(message.data);
    const inner = document.createElement('iframe');
    inner.sandbox = 'allow-scripts';
    inner.srcdoc = `<script>const tell = (value) => parent.postMessage(value, '*');${script}</` + 'script>';
    document.body.append(inner);
})"""


class Page(http.server.BaseHTTPRequestHandler):
    """The same page under every name."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>page</title><body></body>")

    def log_message(self, format, *args):
        pass


@pytest.fixture(scope="module")
def site():
    """The port at which the page is."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


@pytest.fixture(scope="module")
def live():
    refused: list[str] = []
    with LiveServer(make_scenario(1), port=0, origins=["http://friend.example:1"], refused=refused.append) as server:
        yield server, refused


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield chromium
        chromium.close()


@pytest.mark.nightly
@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
def test_a_browser_gets_messages_on_pages_that_may_connect_alone(browser, site, live):
    server, refused = live
    port = int(server.url.rpartition(":")[2])
    page = browser.new_page()

    def heard(origin: str, host: str = "127.0.0.1", *, frame: bool = False) -> int:
        page.goto(f"{origin}:{site}/")
        return page.evaluate(CONNECT, [f"ws://{host}:{port}", frame])

    assert heard("http://localhost") > 0
    assert refused == []
    assert heard("http://evil.example") == -1
    assert heard("http://localhost", frame=True) == -1  # a sandboxed frame: its origin is "null"
    assert heard("http://evil.example", "evil.example") == -1  # this machine by the attacker's name for it
    assert heard("http://localhost.evil.example", "localhost") == -1
    ends = time.monotonic() + PATIENCE  # a refusal is told after the connection was closed
    while len(refused) < 4:
        assert time.monotonic() < ends, refused
        time.sleep(0.01)
    for found, part in zip(
        refused, ("evil.example", "'null'", "the host 'evil.example'", "localhost.evil"), strict=True
    ):
        assert part in found
    page.close()


def request(**headers: str) -> bytes:
    given = {"Host": "127.0.0.1:8765", "Upgrade": "websocket"} | {name: text for name, text in headers.items() if text}
    lines = [f"{name}: {text}" for name, text in given.items()]
    return "\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode()


ALLOWED = (
    *("https://app.foxglove.dev", "https://lichtblick-suite.github.io", "file://"),
    *("http://localhost:8080", "https://localhost", "http://127.0.0.1:3000", "http://[::1]:8080"),
    *("https://viewer.example.org:8080", ""),
)
REFUSED = (
    *("null", "https://studio.foxglove.dev", "https://evil.example", "https://app.foxglove.dev.evil.example"),
    *("https://evil.example/localhost", "https://app.foxglove.dev:444", "http://app.foxglove.dev"),
    *("http://localhost@evil.example", "http://127.0.0.1.nip.io", "https://viewer.example.org"),
    *("chrome-extension://abc", "http://localhost:8080\x00", "http://2130706433", " "),
)  # fmt: skip


@pytest.mark.parametrize("origin", ALLOWED)
def test_the_viewers_and_this_machine_may_connect(origin):
    assert why_refused(request(Origin=origin), ("https://viewer.example.org:8080",)) is None


@pytest.mark.parametrize("origin", REFUSED)
def test_an_origin_that_only_looks_like_one_may_not(origin):
    assert why_refused(request(Origin=origin), ("https://viewer.example.org:8080",))


@pytest.mark.parametrize(
    "head",
    [
        request(Host="evil.example"),
        request(Host="127.0.0.1.evil.example:8765"),
        request(Upgrade="h2c"),
        request().replace(b"GET", b"POST"),
        request().replace(b"\r\nHost: 127.0.0.1:8765", b""),
        request(Origin="http://localhost").replace(b"Upgrade", b"Origin: https://evil.example\r\nUpgrade"),
        request(Origin="http://localhost").replace(b"Upgrade", b"origin : https://evil.example\r\nUpgrade"),
        request(Origin="http://localhost").replace(b"Upgrade", b" https://evil.example\r\nUpgrade"),
        b"\xff\x00\r\n\r\n",
        b"\r\n\r\n",
    ],
)
def test_a_handshake_that_is_read_two_ways_is_refused(head):
    assert why_refused(head, ())


def test_the_server_behind_the_door_is_at_an_address_that_nobody_can_guess():
    """A page cannot try 2^39 addresses and ports; and each server has its own."""
    with LiveServer(make_scenario(1), port=0) as live, LiveServer(make_scenario(1), port=0) as other:
        behind = live._door._behind
        assert behind[0] not in (other._door._behind[0], "127.0.0.1", "127.0.1.1")
        table = Path("/proc/net/tcp").read_text().splitlines()
        ours = {os.readlink(descriptor) for descriptor in Path("/proc/self/fd").iterdir() if descriptor.is_symlink()}
    at_port = [line.split() for line in table if f":{behind[1]:04X} 00000000:0000 0A" in line]
    (listening,) = [fields[1] for fields in at_port if f"socket:[{fields[9]}]" in ours]  # others may have the port, too
    assert listening.startswith(bytes(reversed(socket.inet_aton(behind[0]))).hex().upper())


def test_a_silent_or_endless_client_delays_neither_others_nor_the_end():
    with LiveServer(make_scenario(1), port=0) as server:
        address = ("127.0.0.1", int(server.url.rpartition(":")[2]))
        silent = socket.create_connection(address)
        endless = socket.create_connection(address)
        endless.sendall(b"GET / HTTP/1.1\r\nX: " + b"x" * 50_000)
        with suppress(ConnectionResetError):
            assert endless.recv(10) == b""
        with socket.create_connection(address) as polite:
            polite.sendall(request(Origin="https://evil.example"))
            assert polite.recv(100).startswith(b"HTTP/1.1 403 Forbidden\r\n")
        began = time.monotonic()
    assert time.monotonic() - began < 30.0  # [s]
    silent.close()
    endless.close()


@pytest.mark.parametrize("origin", ["evil.example", "https://", "https://a/b", "*", "https://a b", "null"])
def test_what_is_no_origin_is_refused(origin):
    with pytest.raises(InvalidValue, match="scheme and host of a page"):
        LiveServer(load_scenario("crossing1"), port=0, origins=[origin])

"""The live server and real clients."""

import asyncio
import json
import socket
import struct
import subprocess
import sys
import threading
import time
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import pytest
from mcap.records import Channel, Message, Schema

from mjnav import load_scenario, run
from mjnav.errors import InputError
from mjnav.log import Recorder, front_door, open_log
from mjnav.log.front_door import MAX_CONNECTIONS
from mjnav.log.live import LiveServer
from mjnav.log.read.records import read_records

pytestmark = pytest.mark.xdist_group("real time")

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
websocket = pytest.importorskip("tornado.websocket", reason="no WebSocket client: tornado is not installed")

NUM_TICKS = 20
ARCS = "/candidates/arcs"
PROTOCOL = "foxglove.sdk.v1"
MESSAGE, TIME = 1, 2  # first bytes of what is not JSON


class Client:
    """Speaks https://github.com/foxglove/ws-protocol in a thread of its own, subscribed to all that is offered.

    `messages` holds (time [ns], bytes) by topic, `schemas` what the server said of each, `times` those that it told.
    """

    def __init__(self, url: str):
        self.info: dict = {}
        self.schemas: dict[str, tuple] = {}
        self.messages: dict[str, list[tuple[int, bytes]]] = defaultdict(list)
        self.times: list[int] = []
        self.error: BaseException | None = None
        self._url = url
        self._names: list[str] = []
        self._subscribed, self._done = threading.Event(), threading.Event()
        threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True).start()

    def subscribed(self) -> "Client":
        assert self._subscribed.wait(30.0), self.error
        return self

    def ended(self) -> "Client":
        assert self._done.wait(30.0)
        assert self.error is None
        return self

    async def _run(self) -> None:
        try:
            connection = await websocket.websocket_connect(self._url, subprotocols=[PROTOCOL])
            while (message := await connection.read_message()) is not None:
                if isinstance(message, bytes):
                    self._take(message)
                else:
                    await self._hear(connection, json.loads(message))
            connection.close()
        except BaseException as error:
            self.error = error
        self._done.set()

    async def _hear(self, connection, said: dict) -> None:
        if said["op"] == "serverInfo":
            self.info = said
        elif said["op"] == "advertise":
            for channel in said["channels"]:
                fields = ("encoding", "schemaName", "schemaEncoding", "schema")
                self.schemas[channel["topic"]] = tuple(channel[field] for field in fields)
            first = len(self._names)
            self._names += [channel["topic"] for channel in said["channels"]]
            wanted = [{"id": first + i, "channelId": channel["id"]} for i, channel in enumerate(said["channels"])]
            # What the server does not know it answers, when it has dealt with what came before.
            for subscriptions in (wanted, [{"id": 10**6, "channelId": 10**6}]):
                await connection.write_message(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        elif said["op"] == "status":
            self._subscribed.set()

    def _take(self, message: bytes) -> None:
        if message[0] == TIME:
            self.times.append(struct.unpack_from("<Q", message, 1)[0])
            return
        kind, subscription, time_ns = struct.unpack_from("<BIQ", message)
        assert kind == MESSAGE
        self.messages[self._names[subscription]].append((time_ns, message[13:]))


def deaf(live: LiveServer) -> socket.socket:
    """A connection that subscribes to everything and never reads what it gets."""
    port = int(live.url.rpartition(":")[2])
    connection = socket.create_connection(("127.0.0.1", port))
    lines = ("GET / HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade")
    lines += ("Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version: 13")
    connection.sendall("\r\n".join((*lines, f"Sec-WebSocket-Protocol: {PROTOCOL}", "", "")).encode())
    with connection.makefile("rb") as heard:
        while heard.readline() != b"\r\n":
            pass
        while (said := json.loads(frame(heard)))["op"] != "advertise":
            pass
    wanted = [{"id": i, "channelId": channel["id"]} for i, channel in enumerate(said["channels"])]
    request = json.dumps({"op": "subscribe", "subscriptions": wanted}).encode()
    connection.sendall(struct.pack(">BBQI", 0x81, 0x80 | 127, len(request), 0) + request)  # masked with zeros
    while not live.watched:
        time.sleep(0.001)
    return connection


def frame(stream: BinaryIO) -> bytes:
    """The payload of one WebSocket frame from a server."""
    length = stream.read(2)[1]
    if length > 125:
        size, form = (2, ">H") if length == 126 else (8, ">Q")
        (length,) = struct.unpack(form, stream.read(size))
    return stream.read(length)


def logged(path: Path) -> tuple[dict[str, list[tuple[int, bytes]]], dict[str, tuple]]:
    """The messages of a log and its schemas, as `Client` has them."""
    schemas, channels, messages = {}, {}, defaultdict(list)
    for record in read_records(path):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            messages[channels[record.channel_id].topic].append((record.log_time, bytes(record.data)))
    return messages, {c.topic: (c.message_encoding, schemas[c.schema_id].name) for c in channels.values()}


def shared(client: Client) -> dict[str, list[tuple[int, bytes]]]:
    """What a client got, but for what only clients get."""
    return {name: messages for name, messages in client.ended().messages.items() if name != ARCS}


def write(recorder: Recorder, made_up, num_ticks: int = NUM_TICKS) -> None:
    """A run whose every third tick has a plan, the first without one."""
    with recorder:
        for tick in range(num_ticks):
            recorder.write(made_up.planned(tick) if tick % 3 == 2 else made_up.record(tick))
            recorder.write_timing(made_up.timing(tick))
        recorder.finish(made_up.truth(num_ticks), {})


@pytest.fixture
def live(scenario):
    with LiveServer(scenario, port=0) as server:
        yield server


@pytest.mark.parametrize("threaded", [False, True])
def test_a_client_gets_the_bytes_that_the_file_gets_with_their_times(scenario, made_up, tmp_path, threaded):
    path = tmp_path / "a.mcap"
    with LiveServer(scenario, port=0) as live:
        recorder = Recorder(path, scenario, {}, "<mujoco/>", threaded=threaded, live=live)
        client = Client(live.url).subscribed()
        write(recorder, made_up)
    client.ended()
    messages, schemas = logged(path)
    assert len(client.messages.pop(ARCS)) == NUM_TICKS  # a drawing, which the file has not been asked for
    assert client.schemas.pop(ARCS)[1] == "foxglove.SceneUpdate"
    assert client.messages == messages
    assert {name: said[:2] for name, said in client.schemas.items()} == schemas
    assert client.times == [round(1e8 * tick) for tick in range(NUM_TICKS + 1)]  # simulated time, once a tick
    assert (client.info["name"], client.info["capabilities"]) == ("mjnav made-up, rkhs, seed 0", ["time"])


def test_a_client_that_takes_nothing_holds_up_neither_run_nor_end(scenario, made_up, tmp_path):
    with LiveServer(scenario, port=0) as live:
        recorder = Recorder(tmp_path / "a.mcap", scenario, {}, "<mujoco/>", live=live)
        connection = deaf(live)
        record = made_up.record(0)
        with recorder:
            for tick in range(300):  # 10 MB: more than the system's buffers and the client's queue
                recorder.write(made_up.at(record, tick))
            recorder.finish(made_up.truth(300), {})
    connection.close()
    assert open_log(tmp_path / "a.mcap").topics["/scan"].messages == 300


def connect(live: LiveServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", int(live.url.rpartition(":")[2])), timeout=30.0)


def test_of_a_storm_of_connections_only_so_many_are_held_by_one_thread_and_a_client_gets_through_afterwards(live):
    threads, storm = threading.active_count(), [connect(live) for _ in range(10 * MAX_CONNECTIONS)]
    assert [connection.recv(1) for connection in storm[MAX_CONNECTIONS:]] == [b""] * 9 * MAX_CONNECTIONS
    assert threading.active_count() == threads
    for connection in storm[1:]:
        connection.close()
    ends = time.monotonic() + 30.0  # [s]
    while len(live._door._open) > 1:
        assert time.monotonic() < ends
        time.sleep(0.01)
    assert Client(live.url).subscribed().info["name"] == "mjnav made-up, rkhs, seed 0"
    storm[0].close()


def test_a_handshake_that_comes_byte_by_byte_is_ended(live, monkeypatch):
    monkeypatch.setattr(front_door, "_PATIENCE", 0.5)
    with connect(live) as slow, suppress(ConnectionError):
        ends = time.monotonic() + 30.0  # [s]
        while True:
            assert time.monotonic() < ends
            slow.sendall(b"G")
            time.sleep(0.1)


def test_a_port_that_is_taken_is_refused_in_one_line(scenario, live):
    port = int(live.url.rpartition(":")[2])
    with pytest.raises(InputError, match=rf"^port {port} of 127\.0\.0\.1 .*[Aa]ddress already in use; choose another$"):
        LiveServer(scenario, port=port)


def test_only_this_machine_can_connect(live):
    port = int(live.url.rpartition(":")[2])
    table = Path("/proc/net/tcp").read_text().splitlines() + Path("/proc/net/tcp6").read_text().splitlines()
    listening = [line.split()[1] for line in table if f":{port:04X} " in line and " 0A " in line]
    assert listening == [f"0100007F:{port:04X}"]  # 127.0.0.1


def test_a_run_is_served_while_it_goes_and_its_state_hash_is_that_of_a_run_without(tmp_path):
    command = [sys.executable, "-m", "mjnav.cli.main", "run", "crossing1", "--set", "time_limit=1", "--json"]
    command += ["--live", "--port", "0", "--log", "a.mcap"]
    served = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    with served:
        line = served.stderr.readline()
        assert line.startswith("mjnav: live at ws://127.0.0.1:")
        client = Client(line.split()[3].rstrip(":")).ended()
        summary = json.loads(served.stdout.read())
    assert served.returncode == 0
    assert 0.5 < summary["real_time_factor"] < 1.5  # paced, unless told not to be
    messages, _ = logged(tmp_path / "a.mcap")
    assert {"/tf", "/scene", "/decision", "/tick", ARCS} <= client.messages.keys()
    for topic, got in shared(client).items():
        assert got == messages[topic][-len(got) :]
    plain = run(load_scenario("crossing1", ["time_limit=1"]))
    assert plain.summary["state_hash"] == summary["state_hash"]

"""What serving a run costs a tick: without a server, with one and nobody there, with one client that wants everything.

    uv run python tests/benchmarks/live_overhead.py hall

Unpaced, where encoding, sending and writing are one phase of the loop, and in real time, where a thread of its own does
them. The least of --repeat medians counts. The client is a process of its own.
"""

import argparse
import asyncio
import json
import subprocess
import sys
import tempfile
from contextlib import ExitStack, contextmanager
from pathlib import Path

from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import run
from mjnav.recording.live import LiveServer
from mjnav.scenarios.spec import Scenario

PROTOCOL = "foxglove.sdk.v1"


async def read_everything(url: str) -> None:
    """Takes all messages of all topics until the server goes, and says how many they were."""
    from tornado.websocket import websocket_connect

    connection = await websocket_connect(url, subprotocols=[PROTOCOL])
    count = size = 0
    while (message := await connection.read_message()) is not None:
        if isinstance(message, bytes):
            count, size = count + 1, size + len(message)
        elif (said := json.loads(message))["op"] == "advertise":
            wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in said["channels"]]
            await connection.write_message(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    print(f"the client got {count} messages, {1e-6 * size:.1f} MB", file=sys.stderr)


@contextmanager
def client(live: LiveServer):
    """A client that has subscribed."""
    with subprocess.Popen([sys.executable, __file__, "--read", live.url]) as process:
        while not live.watched:
            process.poll()
        yield
        live.close()


def measure(scenario: Scenario, served: str, *, real_time: bool) -> tuple[float, float]:
    """Median and 99th percentile of a tick's record phase [us]."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        live = stack.enter_context(LiveServer(scenario, port=0)) if served != "no server" else None
        if live is not None and served == "one client":
            stack.enter_context(client(live))
        record = run(scenario, log=folder / "a.mcap", live=live, real_time=real_time).summary["compute_ms"]["record"]
    return 1e3 * record["p50"], 1e3 * record["p99"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--duration", type=float, default=10.0, help="simulated [s] a run")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--read", metavar="URL", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read:
        asyncio.run(read_everything(arguments.read))
        return 0
    scenario = load_scenario(arguments.scene, [f"time_limit={arguments.duration:g}"])
    print(f"{scenario.name}, {scenario.control.rate:g} Hz, everything logged: the record phase [us], p50, p99")
    for real_time in (False, True):
        for served in ("no server", "no client", "one client"):
            p50, p99 = min(measure(scenario, served, real_time=real_time) for _ in range(arguments.repeat))
            print(f"  {'real time' if real_time else 'unpaced':10}  {served:10}  {p50:7.0f}  {p99:7.0f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

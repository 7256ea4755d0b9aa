"""How long `mjnav inspect` and `open_log` take for a large log, and how much memory.

    uv run python benchmarks/big_log.py [--gigabytes 1] [--scene hall] [--keep PATH]

The log holds one real run's messages over and over, with the times and the numbers of ticks going on.
"""

import argparse
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

OPEN = "import sys, mjnav; mjnav.open_log(sys.argv[1])"
COMMANDS = {
    "nothing but the imports": [sys.executable, "-c", "import mjnav.report.inspection"],
    "open_log": [sys.executable, "-c", OPEN],
    "mjnav inspect": [sys.executable, "-m", "mjnav.cli.main", "inspect", "--json"],
}


def write_big_log(scene: str, path: Path, size: int) -> None:
    """A log of at least `size` bytes.

    It has a process of its own: what Linux says of a process's peak memory counts what its parent had when it started.
    """
    from mcap import records

    import mjnav
    from mjnav.log.log_format import RESULT, mcap_writer
    from mjnav.log.read.records import read_records

    run = path.with_name(f"once-{path.name}")
    mjnav.run(mjnav.load_scenario(scene), log=run)
    found = list(read_records(run))
    channels = {record.id: record for record in found if isinstance(record, records.Channel)}
    messages = [record for record in found if isinstance(record, records.Message)]
    last = max(message.sequence for message in messages)  # of the state in which the run ended
    duration = max(message.log_time for message in messages)
    once = [message for message in messages if message.sequence < last]
    with open(path, "wb") as file:
        writer = mcap_writer(file)
        writer.start(library="mjnav")
        for record in found:
            if isinstance(record, records.Schema):
                writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, records.Channel):
                writer.register_channel(record.topic, record.message_encoding, record.schema_id)
            elif isinstance(record, records.Attachment):
                writer.add_attachment(0, 0, record.name, record.media_type, record.data)
            elif isinstance(record, records.Metadata) and record.name != RESULT:
                writer.add_metadata(record.name, record.metadata)
        copies = 0
        while file.tell() < size:
            for message in once:
                is_json = channels[message.channel_id].message_encoding == "json"
                data = _later(message.data, copies * last, 1e-9 * copies * duration) if is_json else message.data
                at = message.log_time + copies * duration
                writer.add_message(message.channel_id, at, data, at, message.sequence + copies * last)
            copies += 1
        writer.add_metadata(RESULT, {"outcome": "timeout", "ticks": str(copies * last)})
        writer.finish()
    run.unlink()


def _later(data: bytes, ticks: int, seconds: float) -> bytes:
    document = json.loads(data)
    if "tick" in document:
        document["tick"] += ticks
    if "time" in document:
        document["time"] += seconds
    return json.dumps(document, separators=(",", ":")).encode()


def cost(command: list[str]) -> tuple[float, float, bytes]:
    """Seconds of wall time, peak memory [MB] and output of a command."""
    start = time.perf_counter()
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(command, stdout=out)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.perf_counter() - start
        out.seek(0)
        printed = out.read()
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return seconds, 1e-3 * usage.ru_maxrss, printed


def main() -> None:
    """Writes the log, reads it, deletes it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gigabytes", type=float, default=1.0)
    parser.add_argument("--scene", default="hall")
    parser.add_argument("--keep", metavar="PATH", help="where the log goes, and stays")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mjnav-big-log-") as folder:
        path = Path(arguments.keep or Path(folder) / "big.mcap")
        asked = (arguments.scene, path, round(1e9 * arguments.gigabytes))
        writing = multiprocessing.get_context("spawn").Process(target=write_big_log, args=asked)
        writing.start()
        writing.join()
        print(f"{path.stat().st_size * 1e-9:.2f} GB")
        for name, command in COMMANDS.items():
            seconds, memory, printed = cost([*command, str(path)])
            print(f"{name:24} {seconds:6.1f} s  {memory:6.0f} MB", flush=True)
        found = json.loads(printed)
        print(f"{found['ticks']['whole']} ticks, {found['ticks']['missing']} missing")


if __name__ == "__main__":
    main()

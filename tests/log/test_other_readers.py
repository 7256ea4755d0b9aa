"""A log is read by another implementation of MCAP, that of Foxglove's own programs, and it finds the same."""

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
from mcap.records import Message

from mjnav.log import open_log
from mjnav.log.read.records import read_records

SCRIPT = Path(__file__).with_name("read_log.mjs")
PACKAGES = ("@mcap/core@2.2.2", "@foxglove/wasm-lz4@1.0.2")  # the second is what Foxglove decompresses with
PATIENCE = 120.0  # [s]


@pytest.fixture(scope="session")
def node_modules() -> Path:
    """The packages, installed once for all runs of the tests."""
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed")
    name = "-".join(PACKAGES).replace("/", "_").replace("@", "")
    home = Path(tempfile.gettempdir(), f"mjnav-npm-{os.getuid()}-{name}")
    if not home.exists():
        beside = tempfile.mkdtemp(prefix=f"{home.name}-")
        quiet = ("--no-save", "--no-package-lock", "--no-audit", "--no-fund", "--ignore-scripts", "--fetch-retries=0")
        command = ["npm", "install", *quiet, "--prefix", beside, *PACKAGES]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        if done.returncode != 0:
            shutil.rmtree(beside)
            pytest.skip(f"npm cannot install {' '.join(PACKAGES)}: {(done.stderr.strip().splitlines() or ['?'])[0]}")
        with suppress(OSError):  # another run of the tests was quicker
            os.rename(beside, home)
    return home / "node_modules"


def read(node_modules, way: str, path) -> dict:
    done = subprocess.run(
        ["node", SCRIPT, node_modules, way, path], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def ours(path) -> dict:
    """What mjnav reads, in the script's words."""
    log = open_log(path)
    messages = [record for record in read_records(path) if isinstance(record, Message)]
    digest = hashlib.sha256(b"".join(message.data for message in messages)).hexdigest()
    return {
        "topics": {name: {"messages": topic.messages, "schema": topic.schema} for name, topic in log.topics.items()},
        "attachments": {name: hashlib.sha256(data).hexdigest() for name, data in log.attachments.items()},
        "first": str(messages[0].log_time),
        "last": str(messages[-1].log_time),
        "digest": digest,
    }


@pytest.mark.parametrize("way", ["stream", "index"])
def test_it_finds_the_same_bytes_in_the_same_order(node_modules, driven, way):
    found = read(node_modules, way, driven.path)
    metadata = found.pop("metadata")
    assert metadata["mjnav/run"] == dict(driven.run)
    assert metadata["mjnav/result"].keys() == driven.result.keys()
    assert metadata["mjnav/result"]["outcome"] == driven.result["outcome"]
    assert (found.pop("footer"), found.pop("done")) == (True, True)
    assert found == ours(driven.path)


def test_it_reads_a_killed_writers_log_as_far_as_mjnav_does(node_modules, driven, tmp_path):
    content, path = driven.path.read_bytes(), tmp_path / "cut.mcap"
    path.write_bytes(content[: int(0.6 * len(content))])
    found = read(node_modules, "stream", path)
    assert list(found.pop("metadata")) == ["mjnav/run"]
    assert (found.pop("footer"), found.pop("done")) == (False, False)
    assert found == ours(path)
    assert 0 < found["topics"]["/tick"]["messages"] < driven.topics["/tick"].messages

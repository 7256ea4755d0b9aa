"""A sweep whose driver is killed, interrupted or has no room on its disk goes on where it was."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mjnav.cli.main import main
from mjnav.study.store import Store

PATIENCE = 120.0  # [s] for a process to get as far as its first episodes on a busy machine
DISK = 2**22  # [bytes]: a busy machine writes a shard, of some 35 kB, for each of 16 episodes
MANY = ("--seeds", "100")  # more than are done before the kill


def start(study: Path, folder: Path, *words: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "mjnav.cli.main", "sweep", str(study), "-o", str(folder), *MANY, *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(condition) -> None:
    ends = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < ends
        time.sleep(0.02)


def descendants(pid: int) -> list[str]:
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [*children, *(further for child in children for further in descendants(int(child)))]


def ids(folder: Path) -> set[str]:
    return set(Store(folder).rows(["id"])["id"].to_pylist())


def finish(study: Path, folder: Path) -> dict[str, str]:
    """Adds what is missing of the small study; the state hashes by id."""
    assert main(["sweep", str(study), "-o", str(folder), "--workers", "1", "--resume"]) == 0
    rows = Store(folder).rows(["id", "state_hash"]).to_pylist()
    found = {row["id"]: row["state_hash"] for row in rows}
    assert len(found) == len(rows)
    return found


def test_a_killed_driver_leaves_no_worker_and_its_sweep_goes_on(small_study, serial_hashes, tmp_path, capsys):
    killed, interrupted = tmp_path / "killed", tmp_path / "interrupted"
    with (
        start(small_study, killed, "--workers", "2") as first,
        start(small_study, interrupted, "--workers", "1") as other,
    ):
        wait_for(lambda: Store(interrupted).has_rows())
        other.send_signal(signal.SIGINT)
        wait_for(lambda: Store(killed).has_rows())
        workers = descendants(first.pid)
        first.kill()
        err = other.communicate()[1]
    wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers))
    assert len(workers) >= 3  # the driver and its workers
    assert other.returncode == 130
    assert err.splitlines()[-1].startswith("mjnav: interrupted: ")
    assert "Traceback" not in err
    for folder in (killed, interrupted):
        kept = ids(folder)
        assert 0 < len(kept) < 400
        found = finish(small_study, folder)
        assert kept <= found.keys()
        assert serial_hashes.items() <= found.items()
    assert "of them are done" in capsys.readouterr().out


@pytest.mark.nightly
def test_a_full_disk_is_a_line_and_the_sweep_goes_on_with_room(small_study, serial_hashes, small_disk, capsys):
    with small_disk(DISK) as disk:
        words = ["sweep", str(small_study), "-o", str(disk / "out"), "--workers", "1", "--json"]
        filler = disk / "filler"
        filler.write_bytes(b"x" * (DISK - 30_000))
        assert main(words) == 1
        told = capsys.readouterr()
        assert told.out == ""
        assert "No space left on device\nfinished episodes are kept: --resume continues" in told.err
        assert ids(disk / "out") <= serial_hashes.keys()
        filler.unlink()
        assert finish(small_study, disk / "out") == serial_hashes

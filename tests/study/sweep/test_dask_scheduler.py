"""Workers of a Dask scheduler, real processes on loopback, give the rows that one process gives."""

import json
import signal
import subprocess
import sys
import time

import distributed  # noqa: F401 - its settings
import pytest
from dask import config as configuration

from mjnav.errors import InputError, MjnavError
from mjnav.study.store import Store
from mjnav.study.sweep.schedulers import dask
from mjnav.study.sweep.sweep import sweep

PATIENCE = 120.0  # [s]
WORKER = ("dask_worker", "--no-nanny", "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1")
SCHEDULER = ("dask_scheduler", "--no-dashboard", "--host", "127.0.0.1", "--port", "0")


@pytest.fixture
def cluster(tmp_path):
    """Starts a scheduler and workers with these options: its address, its process, and those of the workers."""
    started = []

    def start(program, *options):
        file = ("--scheduler-file", str(tmp_path / "scheduler.json"))
        command = [sys.executable, "-m", f"distributed.cli.{program}", *options, *file]
        started.append(subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        return started[-1]

    def cluster(num_workers, *options):
        scheduler, ends = start(*SCHEDULER, *options), time.monotonic() + PATIENCE
        while not (tmp_path / "scheduler.json").exists():
            assert time.monotonic() < ends
            time.sleep(0.05)
        workers = [start(*WORKER, *options) for _ in range(num_workers)]
        return json.loads((tmp_path / "scheduler.json").read_text())["address"], scheduler, workers

    yield cluster
    for process in started:
        process.kill()
        process.wait()


@pytest.mark.nightly
def test_dask_gives_the_serial_rows_and_tells_a_lost_scheduler_in_a_line(
    cluster, tmp_path, small_trials, serial_hashes
):
    address, scheduler, workers = cluster(2)
    store = Store(tmp_path / "out")

    def kill(done, row):
        if done == 4:
            workers[0].send_signal(signal.SIGKILL)

    report = sweep(small_trials, store, dask(address), progress=kill)
    rows = store.rows(["id", "state_hash", "error"]).to_pylist()
    assert (report.run, report.failed, len(rows)) == (16, 0, 16)
    assert {row["id"]: row["state_hash"] for row in rows} == serial_hashes

    silent, impatient = Store(tmp_path / "silent"), dask(address, patience=1.0)
    with pytest.raises(MjnavError, match=f"the scheduler at {address} is lost: no answer for 1 s"):
        sweep(small_trials, silent, impatient, progress=lambda done, row: scheduler.send_signal(signal.SIGSTOP))
    scheduler.send_signal(signal.SIGCONT)
    assert 0 < len(silent.done()) < 16

    cut = Store(tmp_path / "cut")
    with pytest.raises(MjnavError, match=f"the scheduler at {address} is lost: the connection was closed"):
        sweep(small_trials, cut, dask(address), progress=lambda done, row: scheduler.kill())
    assert 0 < len(cut.done()) <= 16
    assert cut.rows(["error"]).to_pylist() == [{"error": None}] * len(cut.done())  # and none is blamed on a worker
    with pytest.raises(InputError, match=rf"^scheduler: found '{address}'; allowed: the address of a Dask scheduler"):
        dask(address)


@pytest.mark.nightly
def test_a_tls_address_wants_settings_and_works_with_them(cluster, tmp_path, small_trials, serial_hashes):
    cert, key = str(tmp_path / "cert.pem"), str(tmp_path / "key.pem")
    made = f"openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=mjnav -keyout {key} -out {cert}"
    subprocess.run(made.split(), capture_output=True, check=True)
    files = ("--tls-ca-file", cert, "--tls-cert", cert, "--tls-key", key)
    address, *_ = cluster(1, "--protocol", "tls", *files)
    assert address.startswith("tls://127.0.0.1:")
    with pytest.raises(InputError, match=f"^scheduler: found '{address}'; allowed: the address"):
        dask(address)
    settings = {"ca-file": cert, "client.cert": cert, "client.key": key}
    with configuration.set({f"distributed.comm.tls.{name}": path for name, path in settings.items()}):
        sweep(small_trials[:2], store := Store(tmp_path / "out"), dask(address))
    rows = store.rows(["id", "state_hash"]).to_pylist()
    assert {row["id"]: row["state_hash"] for row in rows}.items() <= serial_hashes.items()
    assert len(rows) == 2


def test_what_is_no_address_is_told_at_once():
    with pytest.raises(InputError, match="scheduler: found 'cluster'; allowed: the address of a Dask scheduler"):
        dask("cluster")

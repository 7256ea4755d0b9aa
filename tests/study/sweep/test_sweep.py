"""Whatever runs it and whatever is killed, a sweep ends with every episode once, and the same as run one by one."""

import multiprocessing
import os
import signal
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.errors import InputError, MjnavError
from mjnav.study.cells import Cell
from mjnav.study.store import Store
from mjnav.study.sweep.schedulers import local
from mjnav.study.sweep.sweep import sweep
from mjnav.study.trial import Trial, failed_row, run_trial


def hashes(store: Store) -> dict[str, str]:
    rows = store.rows(["id", "state_hash"]).to_pylist()
    assert len({row["id"] for row in rows}) == len(rows)
    return {row["id"]: row["state_hash"] for row in rows}


def serial(trials):
    """A scheduler without worker processes."""
    yield from map(run_trial, trials)


def test_workers_give_the_serial_rows_also_where_one_is_killed(tmp_path, small_trials, serial_hashes):
    killed = []

    def kill_one(done, row):
        if not killed:
            killed.append(max(multiprocessing.active_children(), key=lambda process: process.pid or 0))
            os.kill(killed[0].pid, signal.SIGKILL)

    store = Store(tmp_path / "out")
    report = sweep(small_trials, store, local(2), progress=kill_one)
    assert hashes(store) == serial_hashes
    assert (report.episodes, report.kept, report.run, report.failed) == (16, 0, 16, 0)
    assert (report.interrupted, killed[0].exitcode) == (False, -signal.SIGKILL)
    assert 0.0 < report.episode_seconds < 2.0 * report.seconds
    assert multiprocessing.active_children() == []


def test_results_are_not_mixed_up_with_others_unasked(tmp_path, small_trials, serial_hashes):
    store = Store(tmp_path)
    sweep(small_trials[:1], store, serial)
    with pytest.raises(InputError, match=f"{tmp_path} has results: --resume adds what is missing, or -o names another"):
        sweep(small_trials, store, serial)
    report = sweep(small_trials[:3], store, serial, resume=True)
    assert (report.kept, report.run) == (1, 2)
    assert hashes(store) == {trial.id: serial_hashes[trial.id] for trial in small_trials[:3]}
    assert sweep(small_trials[:3], store, serial, resume=True).run == 0


def test_a_failure_is_a_row_and_is_retried_on_request(tmp_path, small_trials, serial_hashes):
    broken = replace(small_trials[0], cell=replace(small_trials[0].cell, document="schema = 2"))
    store = Store(tmp_path)
    report = sweep([broken, *small_trials[1:3]], store, serial)
    assert (report.run, report.failed, report.interrupted) == (3, 1, False)
    assert store.causes() == {"scenario.toml: schema: found 2; allowed: 1": 1}
    assert sweep([broken, *small_trials[1:3]], store, serial, resume=True).run == 0
    # Mended, it is another episode; the failed one is forgotten.
    report = sweep(small_trials[:3], store, serial, retry_failed=True)
    assert (report.kept, report.run, report.failed) == (2, 1, 0)
    assert hashes(store) == {trial.id: serial_hashes[trial.id] for trial in small_trials[:3]}


class Killed(BaseException):
    pass


@settings(max_examples=10)
@given(st.lists(st.tuples(st.integers(0, 6), st.booleans(), st.booleans()), min_size=1, max_size=4))
def test_however_often_it_is_killed_each_episode_stands_there_once(tmp_path_factory, kills):
    wanted = [Trial("s", Cell(f"scene {i % 3}", "", "", "", "", ""), i // 3) for i in range(12)]
    store = Store(tmp_path_factory.mktemp("killed"))

    def quick(missing):
        for trial in missing:
            yield replace(failed_row(trial, "no episode"), error=None if trial.seed else "first seed")

    class Dying(Store):
        """Dies at one of its shards, before or after that is on the disk; or the disk refuses it."""

        def __init__(self, folder, left, after, refused):
            super().__init__(folder)
            self.left, self.after, self.refused = left, after, refused

        def append(self, rows):
            self.left -= 1
            if self.left >= 0 or self.after:
                super().append(rows)
            if self.left < 0:
                raise MjnavError("disk full") if self.refused else Killed

    for kill in kills:
        with pytest.MonkeyPatch.context() as patch, suppress(Killed, MjnavError):
            patch.setattr("mjnav.study.sweep.sweep.SHARD_ROWS", 2)
            sweep(wanted, Dying(store.folder, *kill), quick, resume=True)
    sweep(wanted, store, quick, retry_failed=True)
    assert sorted(store.rows(["id"])["id"].to_pylist()) == sorted(trial.id for trial in wanted)
    assert store.causes().total() == 3
    assert sweep(wanted, store, quick, resume=True).run == 0

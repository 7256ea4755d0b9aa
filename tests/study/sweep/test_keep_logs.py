"""A kept log is that of its row's episode, whatever is killed and however full the disk is; the rows are the same."""

from dataclasses import replace

import pytest

import mjnav
from mjnav.errors import InputError, InvalidValue
from mjnav.study.keep import kept_log
from mjnav.study.store import Store
from mjnav.study.sweep.schedulers import local
from mjnav.study.sweep.sweep import keeping, sweep
from mjnav.study.trial import run_trial

ROOM = 2**20  # [bytes] for the rows that are left
DISK = 2**21  # [bytes]: fewer than the logs of the small study take


def in_process(trials):
    """A scheduler without worker processes."""
    for trial in trials:
        yield run_trial(trial)


def logs(store: Store) -> dict[str, str | None]:
    return {row["id"]: row["log"] for row in store.rows(["id", "log"]).to_pylist()}


def test_the_rows_are_the_same_and_each_log_is_that_of_its_row(tmp_path, small_trials, serial_hashes):
    for kind in ("failures", "all"):  # nobody reaches the goal within the second that the study has
        store = Store(tmp_path / kind)
        report = sweep(small_trials[:4], store, local(1) if kind == "failures" else in_process, keep_logs=kind)
        assert report.unlogged == 0
        for row in store.rows(["id", "state_hash", "log", "seed", "method"]).to_pylist():
            assert row["state_hash"] == serial_hashes[row["id"]]
            log = kept_log(store.folder, row["log"])
            assert log is not None
            result = mjnav.open_log(log).result
            assert (result["state_hash"], int(result["seed"]), result["controller"]) == (
                row["state_hash"], row["seed"], row["method"].split()[0]
            )  # fmt: skip
        assert len(list((store.folder / "logs").iterdir())) == 4


def test_a_success_keeps_no_log_and_none_are_kept_unasked(tmp_path, small_trials):
    (kept,) = keeping(small_trials[:1], tmp_path, "failures")
    at_goal = kept.cell.document.replace("goal_tolerance = ", "goal_tolerance = 1")
    assert run_trial(kept).log is not None
    row = run_trial(replace(kept, cell=replace(kept.cell, document=at_goal)))
    assert (row.figures["success"], row.log) == (True, None)
    (tmp_path / "logs").rmdir()
    store = Store(tmp_path)
    sweep(small_trials[:1], store, in_process)
    assert list(logs(store).values()) == [None]
    assert not (tmp_path / "logs").exists()
    with pytest.raises(InvalidValue, match=r"keep_logs: found 'failure'; .* did you mean 'failures'"):
        sweep(small_trials[:1], Store(tmp_path / "other"), in_process, keep_logs="failure")


def test_what_a_killed_sweep_left_is_replaced_or_removed(tmp_path, small_trials):
    store = Store(tmp_path / "out")
    sweep(small_trials[:2], store, in_process, keep_logs="failures")
    kept = [tmp_path / "out" / str(name) for name in logs(store).values()]
    for shard in store.folder.glob("*.parquet"):
        shard.unlink()  # killed after the logs, before the rows
    kept[0].write_bytes(b"half a log")
    stranger = kept[0].with_name("mine.mcap")
    stranger.write_bytes(b"")
    sweep(small_trials[:2], store, in_process, keep_logs="failures", resume=True)
    assert sorted(store.folder / str(name) for name in logs(store).values()) == sorted(kept)
    assert mjnav.open_log(kept[0]).result["outcome"] == "timeout"
    for shard in store.folder.glob("*.parquet"):
        shard.unlink()
    sweep(small_trials[:2], store, in_process, resume=True)
    assert list((store.folder / "logs").iterdir()) == [stranger]


def test_a_retry_forgets_the_logs_of_failed_episodes(tmp_path, small_trials):
    cell = small_trials[0].cell
    broken = replace(
        small_trials[0], cell=replace(cell, document=cell.document.replace("time_limit = 1.0", "time_limit = 0.0"))
    )
    store = Store(tmp_path)
    sweep([broken], store, in_process, keep_logs="all")
    assert store.causes().total() == 1
    sweep(small_trials[:1], store, in_process, keep_logs="failures", retry_failed=True)
    assert [kept_log(tmp_path, name) is not None for name in logs(store).values()] == [True]


def test_the_folder_of_logs_is_no_link(tmp_path, small_trials):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "logs").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="logs: found a link; allowed: a folder"):
        sweep(small_trials[:1], Store(tmp_path / "out"), in_process, keep_logs="all")

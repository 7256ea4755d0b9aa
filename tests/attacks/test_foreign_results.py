"""A sweep overwrites and removes no file that a sweep did not write."""

import os
from collections.abc import Callable
from itertools import cycle

import pytest

from mjnav.cli.main import main

OURS = "# mjnav sweep two.toml\nschema = 1\n"


SWEEP = ("sweep", "crossings", "--scene", "crossing1", "--seeds", "1", "-o", "results")


@pytest.fixture
def refused(capsys, tmp_path, monkeypatch) -> Callable[..., str]:
    """What a sweep into a folder says that it refuses, in one line; nothing there is another then."""
    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> str:
        before = tree(tmp_path)
        code, said = main([*SWEEP, *words]), capsys.readouterr().err
        assert (code, said.count("\n"), tree(tmp_path)) == (2, 1, before), said
        return said

    return call


def tree(folder) -> dict[str, bytes | str]:
    return {
        str(path.relative_to(folder)): os.readlink(path) if path.is_symlink() else path.read_bytes()
        for path in folder.rglob("*")
        if path.is_symlink() or path.is_file()
    }


def a_study(folder):
    (folder / "study.toml").write_text("schema = 1\nname = 'mine'\n")


def a_study_that_calls_itself_ours(folder):
    (folder / "study.toml").write_text(OURS)


def a_study_of_bytes(folder):
    (folder / "lock").touch()
    (folder / "study.toml").write_bytes(b"\xff\xfe\0\n" * 100)


def a_study_that_is_a_link(folder):
    (folder / "lock").touch()
    (folder / "elsewhere").write_text(OURS)
    (folder / "study.toml").symlink_to("elsewhere")


def a_lock(folder):
    (folder / "lock").write_text("pid 4711\n")


def a_lock_that_is_a_link(folder):
    (folder / "lock").symlink_to("not yet there")


def a_shard_of_another_program(folder):
    (folder / "part-0.parquet").write_bytes(b"PAR1 of another program PAR1")


def a_failed_shard_of_another_program(folder):
    (folder / "failed-us-east.parquet").write_bytes(b"PAR1")


def a_folder_for_a_shard(folder):
    (folder / "part-000000-1f6c0a12.parquet").mkdir()
    (folder / "part-000000-1f6c0a12.parquet" / "x").touch()


FOREIGN = (
    a_study,
    a_study_that_calls_itself_ours,
    a_study_of_bytes,
    a_study_that_is_a_link,
    a_lock,
    a_lock_that_is_a_link,
    a_shard_of_another_program,
    a_failed_shard_of_another_program,
    a_folder_for_a_shard,
)


WORDS = ((), ("--resume", "--accept-changed"), ("--retry-failed",), ("--dry-run",))


@pytest.mark.parametrize(("foreign", "words"), list(zip(FOREIGN, cycle(WORDS), strict=False)))
def test_a_file_that_no_sweep_wrote_is_refused_and_stays(refused, tmp_path, foreign, words):
    (tmp_path / "results").mkdir()
    foreign(tmp_path / "results")
    assert "not written by mjnav" in refused(*words)


@pytest.mark.parametrize("what", ["a file", "a link to nowhere"])
def test_a_folder_that_is_none_is_refused_and_stays(refused, tmp_path, what):
    place = tmp_path / "results"
    place.write_text("mine") if what == "a file" else place.symlink_to("nowhere")
    assert refused() == f"mjnav: results: found {what}; allowed: a folder for results, or none yet\n"

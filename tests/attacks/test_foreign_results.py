"""A sweep overwrites and removes no file that a sweep did not write."""

import os
from collections.abc import Callable
from itertools import cycle

import pytest

from mjnav.cli.main import main

OURS = b"# mjnav sweep two.toml\nschema = 1\n"


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


# What lies in the folder: bytes, the target of a link, or None for a folder.
FOREIGN = (
    {"study.toml": b"schema = 1\nname = 'mine'\n"},
    {"study.toml": OURS},
    {"lock": b"", "study.toml": b"\xff\xfe\0\n" * 100},
    {"lock": b"", "elsewhere": OURS, "study.toml": "elsewhere"},
    {"lock": b"pid 4711\n"},
    {"lock": "not yet there"},
    {"part-0.parquet": b"PAR1 of another program PAR1"},
    {"failed-us-east.parquet": b"PAR1"},
    {"part-000000-1f6c0a12.parquet": None, "part-000000-1f6c0a12.parquet/x": b""},
)


def make(folder, files):
    folder.mkdir()
    for name, content in files.items():
        path = folder / name
        if content is None:
            path.mkdir()
        elif isinstance(content, str):
            path.symlink_to(content)
        else:
            path.write_bytes(content)


WORDS = ((), ("--resume", "--accept-changed"), ("--retry-failed",), ("--dry-run",))


@pytest.mark.parametrize(("foreign", "words"), list(zip(FOREIGN, cycle(WORDS), strict=False)))
def test_a_file_that_no_sweep_wrote_is_refused_and_stays(refused, tmp_path, foreign, words):
    make(tmp_path / "results", foreign)
    assert "not written by mjnav" in refused(*words)


@pytest.mark.parametrize("what", ["a file", "a link to nowhere"])
def test_a_folder_that_is_none_is_refused_and_stays(refused, tmp_path, what):
    place = tmp_path / "results"
    place.write_text("mine") if what == "a file" else place.symlink_to("nowhere")
    assert refused() == f"mjnav: results: found {what}; allowed: a folder for results, or none yet\n"

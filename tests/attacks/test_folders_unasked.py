"""No command makes a folder that nobody asked for."""

import pytest

from mjnav.cli.main import main

SHORT = ("--set", "time_limit=0.2", "--controller", "mean")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    assert main(["run", "crossing1", "--log", str(path), *SHORT]) == 0
    return str(path)


@pytest.mark.parametrize(
    "words",
    [
        ("run", "crossing1", "--log", "new/a.mcap"),
        ("rate-test", "crossing1", "--log", "new/a.mcap"),
        ("surface", "crossing1", "--at", "0", "-o", "new/a.png"),
        ("surface", "crossing1", "--at", "0", "-o", "a.png", "--data", "new/a.npz"),
        ("calibrate", "crossing1", "-o", "new/a.png"),
        ("compare", "crossings", "-o", "new/a.csv"),
        ("render", "{log}", "-o", "new/a.png"),
        ("render", "{log}", "-o", "new/a.mp4"),
        ("report", "{log}", "-o", "new/a.html"),
        ("recover", "{log}", "new/a.mcap"),
        ("export", "{log}", "new/a", "--format", "tum"),
    ],
)
def test_a_folder_that_is_missing_is_named_before_anything_starts(words, log, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([word.format(log=log) for word in words]) == 2
    said = capsys.readouterr()
    (line,) = said.err.splitlines()
    assert (said.out, line.partition(": there is no folder ")[2]) == ("", str(tmp_path / "new"))
    assert list(tmp_path.iterdir()) == []


def test_the_default_folder_is_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "crossing1", *SHORT]) == 0
    assert len(list(tmp_path.glob("runs/out/*.mcap"))) == 1


def test_a_default_folder_that_cannot_be_made_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").write_text("")
    assert main(["run", "crossing1", *SHORT]) == 2
    assert capsys.readouterr().err == "mjnav: runs/out: cannot be made: Not a directory\n"

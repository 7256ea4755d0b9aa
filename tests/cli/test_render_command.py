"""`mjnav render`: the films and pictures that it makes, and what it refuses. Skipped, saying so, without a renderer."""

import os
import pty
import signal
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mjnav import load_scenario, run
from mjnav.errors import InputError
from mjnav.world.render import open_context
from tests.loop.test_replay import rewrite

SMALL = ("--size", "160x90")
DURATION = 1.0  # [s] of the run


@pytest.fixture(scope="module", autouse=True)
def _renderer():
    try:
        open_context(64, 64).free()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    run(load_scenario("crossing1", [f"time_limit={DURATION}"]), log=path)
    return path


def frames(path: Path) -> list[np.ndarray]:
    av = pytest.importorskip("av", reason="av is not installed")
    with av.open(str(path)) as film:
        return [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_film_has_the_frames_asked_for_of_a_scene_that_moves(mjnav, log, tmp_path):
    said = mjnav("render", log, "-o", "a.mp4", "--fps", 5, "--size", "320x180")
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("a.mp4: 6 frames, 1.2 s, ")
    shown = frames(tmp_path / "a.mp4")
    assert [frame.shape for frame in shown] == [(180, 320, 3)] * 6  # at 0, 0.2 .. 1.0 s
    assert all(len(np.unique(frame.reshape(-1, 3), axis=0)) > 100 for frame in shown)
    below_the_clock = [frame[50:].astype(int) for frame in shown]
    assert all((np.abs(b - a) > 40).any(axis=2).sum() > 10 for a, b in pairwise(below_the_clock))
    assert files(tmp_path) == ["a.mp4"]


def test_a_picture_has_its_size_and_moment(mjnav, log, tmp_path):
    said = mjnav("render", log, "-o", "a.png", "--at", 0.52, *SMALL)
    assert (said.code, said.out) == (0, "a.png: 0.5 s\n")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (160, 90)
        assert len(picture.getcolors(160 * 90)) > 100


def test_a_picture_is_of_a_tick_behind_a_gap_and_a_film_says_that_it_ends_there(mjnav, log, tmp_path):
    holed = rewrite(log, keep=lambda tick: tick not in (4, 5))
    said = mjnav("render", holed, "-o", "a.png", "--at", 0.8, *SMALL)
    assert (said.code, said.out) == (0, "a.png: 0.8 s\n")
    said = mjnav("render", holed, "-o", "a.gif", "--fps", 10, *SMALL)
    assert (said.code, said.out[:17]) == (0, "a.gif: 4 frames, ")
    assert said.err == f"mjnav: {holed} lacks ticks after 0.3 s, where the film ends\n"


def test_on_a_terminal_it_shows_how_far_it_is_and_interrupted_leaves_what_was_there(start, log, tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"before")
    ours, its = pty.openpty()
    process = start("render", log, "-o", "a.mp4", "--speed", 0.01, *SMALL, stderr=its)
    os.close(its)
    shown = b""
    while b" of 2501 frames" not in shown:
        shown += os.read(ours, 4096)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130
    os.close(ours)
    assert files(tmp_path) == ["a.mp4"]
    assert (tmp_path / "a.mp4").read_bytes() == b"before"

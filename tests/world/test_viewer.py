"""The window on a run, under a virtual display; skipped, saying so, where there is none."""

import json
import os
import shutil
import subprocess

import pytest

from mjnav import load_scenario, run
from mjnav.cli.main import main
from mjnav.errors import InputError
from mjnav.world.viewer import Viewer

pytestmark = pytest.mark.xdist_group("real time")


@pytest.fixture(scope="module")
def display():
    """A display of our own."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "800x600x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL) as server:
        os.close(writing)
        with open(reading) as number:
            name = number.readline().strip()
        if not name:
            pytest.skip("Xvfb does not start")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("DISPLAY", f":{name}")
            yield f":{name}"
        import glfw

        glfw.terminate()  # it must not outlive its display
        server.terminate()


# Before the others: GLFW opens one display a process.
def test_without_a_display_the_error_says_what_to_do(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match=r"^no display: use `mjnav run --live`, or `mjnav render LOG -o film\.mp4`"):
        Viewer(load_scenario("crossing1"))


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_a_run_that_is_watched_ends_in_the_same_state(display, capsys, engine):
    settings = [f"physics.engine={engine}", "time_limit=2"]
    words = [word for setting in settings for word in ("--set", setting)]
    assert main(["run", "crossing1", "--view", "--no-real-time", "--no-log", "--json", *words]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["state_hash"] == run(load_scenario("crossing1", settings)).summary["state_hash"]

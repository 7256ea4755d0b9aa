"""`mjnav run --live` and `--view`: what they say and what they refuse before anything starts."""

import json
import re
import socket

import pytest

pytestmark = pytest.mark.xdist_group("real time")

SHORT = ("--set", "time_limit=0.3", "--no-log")


def test_a_live_run_says_where_it_is_served_on_standard_error_only(mjnav):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    said = mjnav("run", "crossing1", "--live", "--port", 0, "--no-real-time", "--json", *SHORT)
    assert said.code == 0
    assert re.match(r"mjnav: live at ws://127\.0\.0\.1:\d+: ", said.err)
    plain = mjnav("run", "crossing1", "--json", *SHORT)
    assert json.loads(said.out)["state_hash"] == json.loads(plain.out)["state_hash"]


@pytest.mark.parametrize(("words", "paced"), [(("--live", "--port", "0"), True), ((), False)])
def test_a_run_that_is_looked_at_is_paced(mjnav, words, paced):
    if words:
        pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    assert ("deadlines missed" in mjnav("run", "crossing1", *words, *SHORT).out) == paced


def test_a_port_that_is_taken_is_one_line(mjnav, tmp_path):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        said = mjnav("run", "crossing1", "--live", "--port", port)
    assert said.code == 2
    assert said.err == f"mjnav: port {port} of 127.0.0.1 cannot be served: Address already in use; choose another\n"
    assert list(tmp_path.iterdir()) == []


def test_without_a_display_a_window_is_refused_in_one_line(mjnav, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    said = mjnav("run", "crossing1", "--view")
    assert (said.code, said.err.count("\n")) == (2, 1)
    assert said.err.startswith("mjnav: no display: use `mjnav run --live`")
    assert list(tmp_path.iterdir()) == []

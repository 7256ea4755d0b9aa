import argparse
import json

import pytest

from mjnav.cli import inspect
from mjnav.errors import InputError
from mjnav.recording import Recorder


def run(capsys, *words: str) -> str:
    parser = argparse.ArgumentParser()
    inspect.configure(parser)
    assert inspect.execute(parser.parse_args(list(words))) == 0
    return capsys.readouterr().out


@pytest.fixture
def log(tmp_path, scenario, made_up):
    path = tmp_path / "run.mcap"
    with Recorder(path, scenario, {"scene": "made-up", "argv": "mjnav run " + "x" * 90}, "<mujoco/>") as recorder:
        for tick in range(11):
            recorder.write(made_up.record(tick))
        recorder.finish(
            made_up.truth(11), {"outcome": "goal", "success": True, "collisions": {"person": 0}, "path_ratio": None}
        )
    return str(path)


def test_json_has_the_documented_keys_and_nothing_else(capsys, log):
    printed = json.loads(run(capsys, log, "--json"))
    assert list(printed) == ["schema", "complete", "truncated", "duration_s", "outcome", "topics", "run", "result"]
    assert (printed["schema"], printed["complete"], printed["truncated"]) == (1, True, False)
    assert printed["duration_s"] == pytest.approx(1.1)
    assert printed["outcome"] == printed["result"]["outcome"] == "goal"
    assert printed["result"]["path_ratio"] is None
    scan = printed["topics"]["/scan"]
    assert set(scan) == {"schema", "messages", "hz", "max_gap_s", "bytes"}
    assert (scan["schema"], scan["messages"]) == ("foxglove.LaserScan", 11)
    assert (scan["hz"], scan["max_gap_s"]) == (pytest.approx(10.0), pytest.approx(0.1))
    assert printed["topics"]["/events"] == {
        "schema": "foxglove.Log",
        "messages": 0,
        "hz": None,
        "max_gap_s": None,
        "bytes": 0,
    }


def test_text_says_the_outcome_first_and_cuts_nothing_off_in_a_pipe(capsys, log):
    text = run(capsys, log)
    lines = text.splitlines()
    assert lines[0] == "goal: 1.1 s of simulated time"
    assert "x" * 90 in text
    assert any(line.split() == ["success", "yes"] for line in lines)
    (scan,) = (line for line in lines if line.startswith("/scan"))
    assert scan.split()[1:5] == ["foxglove.LaserScan", "11", "10.00", "0.100"]
    assert "\x1b" not in text
    assert lines.index(scan) > lines.index("result") < lines.index("run")


def test_a_killed_run_is_said_to_be_one(capsys, tmp_path, log):
    with open(log, "rb") as file:
        content = file.read()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: content.index(b"lz4") + 20])
    assert run(capsys, str(cut)).splitlines()[0] == (
        "the run did not end: no messages; the file has no end: its writer was killed"
    )
    printed = json.loads(run(capsys, str(cut), "--json"))
    assert (printed["complete"], printed["truncated"], printed["duration_s"], printed["result"]) == (
        False,
        True,
        None,
        None,
    )


def test_a_missing_log_is_bad_input():
    with pytest.raises(InputError, match=r"nowhere\.mcap: cannot be read"):
        inspect.execute(argparse.Namespace(log="nowhere.mcap", json=False))

"""A method that chooses from no candidates: what needs them is null, and everything else works."""

import json

import numpy as np
import pytest

from mjnav.cli.main import main
from mjnav.log import open_log
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import run


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    path = tmp_path_factory.mktemp("orca") / "run.mcap"
    scenario = load_scenario("hall", ("time_limit=0.5",), controller="orca")
    return scenario, path, run(scenario, log=path)


def test_its_nominal_control_and_costs_are_null(logged):
    _, path, result = logged
    log = open_log(path)
    decisions = [message.value for message in log.messages("/decision")]
    assert len(decisions) == 5
    assert {(d["nominal"], d["cost"], d["status"]) for d in decisions} == {(None, None, "ok")}
    assert np.isnan(result.trajectory.nominal).all()
    assert list(log.messages("/candidates")) == []


def test_inspect_and_render_take_its_log(logged, tmp_path, capsys):
    assert main(["inspect", str(logged[1]), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["run"]["controller"] == "orca"
    picture = tmp_path / "end.png"
    assert main(["render", str(logged[1]), "-o", str(picture)]) == 0
    assert picture.stat().st_size > 10_000

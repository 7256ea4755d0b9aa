"""A value without effect is refused before a run; a log that has one can be read."""

import json
from dataclasses import replace

import pytest

from mjnav.cli.main import main
from mjnav.errors import InvalidValue
from mjnav.log import Recorder
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.provenance import run_info
from mjnav.scene import dumps

DIRECT = "estimation.robot.source=direct"
IDLE = {  # settings, of which the last has no effect beside the others
    (DIRECT, "estimation.robot.filter=ekf"): "no filter where source is",
    ("estimation.obstacles.source=direct", "estimation.obstacles.filter=kalman"): "no filter where source is",
    ("sensors.lidar.mixed=0.5",): "no mixed pixels where beam_width is 0",
    ("control.latency.trace=[0.01]", "control.delay=2"): "delay or latency, not both",
    ("control.latency.model=measured", "control.latency.order=recorded"): 'an order for model "sampled" only',
}


@pytest.mark.parametrize(
    ("method", "key", "value"), [("mppi", "num_v", "7"), ("orca", "form", "line"), ("rkhs-plan", "window", "bounds")]
)
def test_a_parameter_that_the_method_does_not_have_is_refused_everywhere(method, key, value, tmp_path, capsys):
    told = f"control.{key}: found {key!r}; allowed: parameters of {method}: approach_time, "
    assert main(["run", "crossing1", "--no-log", "--controller", method, "--set", f"control.{key}={value}"]) == 2
    assert f"--set: {told}" in capsys.readouterr().err
    file = tmp_path / "own.toml"
    document = dumps(load_scenario("crossing1", ["control.form=line"])).replace(
        'method = "rkhs"', f'method = "{method}"'
    )
    file.write_text(document.replace('form = "line"', f"{key} = 1"))
    assert main(["run", str(file), "--no-log"]) == 2
    assert f"{file}: {told}" in capsys.readouterr().err


@pytest.mark.parametrize(("settings", "allowed"), IDLE.items())
def test_a_value_that_another_replaces_is_refused(settings, allowed, capsys):
    assert main(["run", "crossing1", "--no-log", *(f"--set={setting}" for setting in settings)]) == 2
    assert capsys.readouterr().err.startswith(f"mjnav: --set: {settings[-1].partition('=')[0]}: found ")
    with pytest.raises(InvalidValue, match=f"allowed: {allowed}"):
        load_scenario("crossing1", settings)


def test_an_old_log_with_an_idle_parameter_is_read_and_its_replay_refused(tmp_path, capsys):
    path, records = tmp_path / "before.mcap", []
    scenario = load_scenario("crossing1", ["time_limit=0.3", "estimation.robot.source=direct"], controller="orca")
    result = Episode(scenario, watch=records.append).run()
    control = replace(scenario.control, parameters={"num_v": 7})
    robot = replace(scenario.estimation.robot, filter="ekf")
    before = replace(scenario, control=control, estimation=replace(scenario.estimation, robot=robot))
    with Recorder(path, before, run_info(scenario, 0, ""), "<mujoco/>") as recorder:
        for record in records:
            recorder.write(record)
        recorder.finish(records[-1].truth, result.summary)
    assert main(["inspect", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["run"]["controller"] == "orca"
    assert main(["export", str(path), str(tmp_path / "csv"), "--format", "csv"]) == 0
    capsys.readouterr()
    assert main(["replay", str(path)]) == 2
    told = f"mjnav: {path}: scenario.toml: control.num_v: found 'num_v'; allowed: parameters of orca: "
    error = capsys.readouterr().err
    assert error.startswith(told)
    assert error.count("\n") == 1

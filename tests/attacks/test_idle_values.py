"""A value without effect is refused before a run; a log that has one can be read."""

import json
from dataclasses import replace

import pytest

from mjnav.cli.main import main
from mjnav.log import Recorder
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.provenance import run_info
from mjnav.scene import dumps

STUDY = """
schema = 1
name = "idle"
scenes = ["crossing1"]
[grid]
control.form = ["line", "segment"]
[[methods]]
controller = "mean"
[[methods]]
controller = "orca"
"""
DIRECT = "estimation.robot.source=direct"
IDLE = {
    "an unused filter of the robot": (
        [DIRECT, "estimation.robot.filter=ekf"],
        "--set: estimation.robot.filter: found 'ekf'; allowed: no filter where source is \"direct\"",
    ),
    "an unused filter of the people": (
        ["estimation.obstacles.filter=kalman", "estimation.obstacles.source=direct"],
        "--set: estimation.obstacles.filter: found 'kalman'; allowed: no filter where source is \"direct\"",
    ),
    "mixed pixels of beams without a width": (
        ["sensors.lidar.mixed=0.5"],
        "--set: sensors.lidar.mixed: found 0.5; allowed: no mixed pixels where beam_width is 0",
    ),
    "a delay beside a latency": (
        ["control.delay=2", "control.latency.trace=[0.01]"],
        "--set: control.delay: found 2; allowed: delay or latency, not both",
    ),
    "an order of what is measured": (
        ["control.latency={model='measured', order='recorded'}"],
        "--set: control.latency.order: found 'recorded'; allowed: an order for model \"sampled\" only",
    ),
}


@pytest.mark.parametrize("method", ["mppi", "orca", "rkhs-plan"])
@pytest.mark.parametrize("setting", ["num_v=7", "window=bounds", "form=line", "clip=1", "horizon=1", "scale=2"])
def test_a_parameter_that_the_method_does_not_have_is_refused_everywhere(method, setting, tmp_path, capsys):
    key = setting.partition("=")[0]
    told = f"control.{key}: found {key!r}; allowed: parameters of {method}: approach_time, "
    assert main(["run", "crossing1", "--no-log", "--controller", method, "--set", f"control.{setting}"]) == 2
    assert f"--set: {told}" in capsys.readouterr().err
    file = tmp_path / "own.toml"
    document = dumps(load_scenario("crossing1", ["control.form=line"])).replace(
        'method = "rkhs"', f'method = "{method}"'
    )
    file.write_text(document.replace('form = "line"', f"{key} = 1"))
    assert main(["run", str(file), "--no-log"]) == 2
    assert f"{file}: {told}" in capsys.readouterr().err


def test_a_grid_over_a_parameter_that_a_method_lacks_names_the_cell(tmp_path, capsys):
    file = tmp_path / "idle.toml"
    file.write_text(STUDY)
    assert main(["sweep", str(file), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert f"{file}: scene crossing1, setting form=line, method orca: control.form: found 'form'; allowed: " in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("settings", "message"), IDLE.values(), ids=IDLE)
def test_a_value_that_another_replaces_is_refused(settings, message, capsys):
    options = [part for setting in settings for part in ("--set", setting)]
    assert main(["run", "crossing1", "--no-log", *options]) == 2
    assert capsys.readouterr().err == f"mjnav: {message}\n"


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

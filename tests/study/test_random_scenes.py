"""Random scenes in studies and logs: a seed has one layout, wherever it is run again."""

import json
import shlex

import pytest

import mjnav
from mjnav.cli.main import main
from mjnav.study.cells import resolve
from mjnav.study.compare.worst_seeds import run_commands
from mjnav.study.store import Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.sweep import trials
from mjnav.study.trial import prepared, run_trial

STUDY = """
schema = 1
name = "drawn"
scenes = ["rooms"]
seeds = { first = 5, count = 3 }
set = { physics.engine = "kinematic", time_limit = 0.5 }
methods = [{ controller = "rkhs" }, { controller = "mean" }]
"""
QUICK = {"physics.engine": "kinematic", "time_limit": 0.5}


def bodies(scenario):
    return scenario.robot, scenario.walls, scenario.tables, scenario.pillars, scenario.people


@pytest.fixture
def study_file(tmp_path):
    path = tmp_path / "drawn.toml"
    path.write_text(STUDY)
    return path


def test_the_command_of_a_seed_runs_the_same_episode(study_file, capsys):
    study = load_study(study_file)
    commands = run_commands(study, Store(study_file.parent / "none"))
    trial = trials(study, resolve(study))[5]
    program, *words = shlex.split(commands[trial.cell.scene, trial.cell.setting, trial.cell.method])
    assert program == "mjnav"
    assert main([*words, "--seed", str(trial.seed), "--json", "--no-log"]) == 0
    found = json.loads(capsys.readouterr().out)
    row = run_trial(trial).figures
    assert (found["state_hash"], found["layout"]) == (row["state_hash"], f"reporting {trial.seed}")


def test_a_log_of_a_random_scene_replays(tmp_path):
    scenario = mjnav.load_scenario("rooms", QUICK, seed=5)
    mjnav.run(scenario, log=tmp_path / "a.mcap")
    assert bodies(mjnav.open_log(tmp_path / "a.mcap").scenario()) == bodies(scenario)
    assert mjnav.replay(tmp_path / "a.mcap").identical


@pytest.mark.parametrize("scene", ["rooms", "crowds"])
def test_training_and_reporting_meet_other_layouts(study_file, scene):
    study = load_study(study_file)
    by_purpose = []
    for overrides in ((), ("layout.purpose=training",)):
        found = [prepared(trial) for trial in trials(study, resolve(study, overrides, [scene]))]
        by_purpose.append({str(bodies(scenario)) for scenario in found})
    reporting, training = by_purpose
    assert len(reporting) == len(training) == study.seeds.count
    assert not reporting & training

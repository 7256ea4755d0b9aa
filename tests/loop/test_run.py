"""`mjnav.run`: what it takes, and where its log goes."""

import re
from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav import scene
from mjnav.errors import InputError, InvalidValue
from mjnav.log import open_log
from mjnav.loop.prepare import load_scenario

SHORT = ("time_limit=0.4",)


def test_seed_and_controller_take_the_place_of_the_scenarios_own():
    scenario = load_scenario("crossing1", (*SHORT, "control.degree=3", "control.rate=5"))
    summary = mjnav.run(scenario, seed=7, controller="mean").summary
    assert (summary["seed"], summary["controller"], summary["ticks"]) == (7, "mean", 2)
    other = load_scenario("crossing1", (*SHORT, "control.rate=5"), controller="mean", seed=7)
    assert summary["state_hash"] == mjnav.run(other).summary["state_hash"]
    assert (scenario.seed, scenario.control.method) == (0, "rkhs")


def test_a_default_log_is_named_after_the_run_below_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("crossing1", (*SHORT, 'name="my scene"'), seed=3)
    paths = [Path(mjnav.run(scenario, log=True).summary["log"]) for _ in range(2)]
    for path in paths:
        assert re.fullmatch(r"runs/out/my_scene-rkhs-3-\d{8}T\d{6}\.\d{6}\.mcap", str(path))
        assert open_log(path).complete
    assert len(set(paths)) == 2  # also within a second


def test_what_cannot_be_used_is_refused_before_anything_starts(tmp_path):
    existing = tmp_path / "a.mcap"
    existing.write_bytes(b"mine")
    with pytest.raises(InputError, match="exists already"):
        mjnav.run("crossing1", log=existing)
    assert existing.read_bytes() == b"mine"
    with pytest.raises(InputError, match="a folder"):
        mjnav.run("crossing1", log=tmp_path)
    with pytest.raises(InvalidValue, match="did you mean 'crossing1'"):
        mjnav.run("crosing1")
    with pytest.raises(InvalidValue, match=r"control\.method.*did you mean 'mean'"):
        mjnav.run("crossing1", controller="meen")
    for seed in (-1, 1.5, "a", np.nan, 10**400):
        with pytest.raises(InvalidValue, match=r"seed: found .*; allowed: (a )?whole number"):
            mjnav.run("crossing1", seed=seed)
    for overrides in (None, 3, [3], {3: 4}, [("a",)], [b"time_limit=1"]):
        with pytest.raises(InvalidValue, match=r"^overrides: found .*; allowed: values by dotted key"):
            load_scenario("crossing1", overrides)
    with pytest.raises(InvalidValue, match="stop: found 3; allowed: a function"):
        mjnav.run("crossing1", stop=3)


def test_errors_in_a_methods_parameters_name_where_they_came_from(tmp_path):
    with pytest.raises(InvalidValue, match=r"^overrides: control\.degre: .*did you mean 'degree'"):
        load_scenario("crossing1", ("control.degre=2",))
    with pytest.raises(InvalidValue, match=r"^controller: control\.method: "):
        load_scenario("crossing1", controller="rkh")
    path = tmp_path / "mine.toml"
    path.write_text(scene.dumps(load_scenario("crossing1")).replace("[control]", "[control]\ndegre = 2"))
    with pytest.raises(InvalidValue, match=rf"^{re.escape(str(path))}: control\.degre: "):
        load_scenario(path)

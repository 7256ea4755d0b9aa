"""`mjnav surface`: what it prints, what it writes and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mjnav.control.decision_surface import decision_surface
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import column_names, record_at
from mjnav.robot.controller import build_controller

QUICK = ("--grid", "5", "--set", "physics.engine=kinematic")


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_picture_and_arrays_go_below_the_working_folder_named_by_the_moment(mjnav, tmp_path):
    said = mjnav("surface", "crossing1", "--controller", "mean", "--seed", "2", "--at", "0.25", *QUICK)
    assert said.code == 0
    stem = "runs/out/crossing1-mean-2-0.25s-surface"
    assert files(tmp_path) == [f"{stem}.npz", f"{stem}.png"]
    lines = said.out.splitlines()
    assert lines[0] == "crossing1, mean, seed 2, 0.20 s"
    assert [line.split()[0] for line in lines[1:]] == ["chosen", "nominal", "minimum", "picture", "arrays"]
    assert lines[-2:] == [f"  picture   {stem}.png", f"  arrays    {stem}.npz"]
    picture = np.asarray(Image.open(tmp_path / f"{stem}.png"))
    assert min(picture.shape[:2]) > 500
    assert picture.std() > 10.0  # not blank


@pytest.mark.parametrize(("scene", "window"), [("hall", "bounds"), ("lane", "reachable")])
def test_the_arrays_are_the_surface_of_the_moments_decision(mjnav, tmp_path, scene, window):
    options = ("--seed", "3", "--window", window, "--controller", "rkhs", *QUICK)
    printed = json.loads(mjnav("surface", scene, "--at", "1.3", "-o", "a.png", "--json", *options).out)
    scenario = load_scenario(scene, ("physics.engine=kinematic",), controller="rkhs", seed=3)
    record = record_at(scenario, 1.3)
    s = decision_surface(build_controller(scenario), record.observation, record.decision, window=window, num=5)
    with np.load(tmp_path / "a.npz") as data:
        arrays = dict(data)  # no pickles
    for name in ("v", "omega", "goal", "total", "nominal", "reachable"):
        assert (arrays[name] == getattr(s, name)).all()
    assert (arrays["cone_by_obstacle"] == s.cone).all()
    assert (arrays["lane_by_side"] == s.lane).all()
    assert tuple(arrays["chosen"]) == (record.decision.v, record.decision.omega)
    assert tuple(arrays["names"]) == column_names(scenario, record.seen)
    assert arrays["cone_by_obstacle"].shape == (5, 5, len(arrays["names"]))
    assert arrays["cone"] == pytest.approx(arrays["cone_by_obstacle"].sum(axis=-1))
    assert arrays["lane"] == pytest.approx(arrays["lane_by_side"].sum(axis=-1))
    assert arrays["total"] == pytest.approx(arrays["goal"] + arrays["cone"] + arrays["lane"])
    about = {key: arrays[key].item() for key in ("scene", "controller", "seed", "time_s", "window")}
    assert about == {"scene": scene, "controller": "rkhs", "seed": 3, "time_s": record.truth.time, "window": window}
    costs = record.decision.costs
    assert printed["chosen"] == {"v": record.decision.v, "omega": record.decision.omega, "total": costs.total.min()}
    assert printed["nominal"]["total"] == costs.total[costs.nominal]
    assert printed["minimum"]["total"] == s.total.min()

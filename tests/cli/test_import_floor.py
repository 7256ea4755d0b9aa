"""`mjnav import world` and `mjnav import map`, and runs on them without a run file."""

import json

from mjnav.scene import load
from tests.scene.test_floor_import import collision, cylinder, link, model, pose, world

ROW = [model(pose(f"{x} 0.8 0.5 0 0 0") + link(collision(cylinder())), f"c{x}") for x in range(5)]
MESH = model(link(collision("<mesh/>")), "chair")
WAY = ("--start", "-1,0,0", "--goal", "2,0")
QUICK = ("--set", "physics.engine=kinematic", "--set", "time_limit=0.5", "--controller", "mean", "--json")


def test_a_world_becomes_a_run_file_that_runs_and_what_is_left_out_is_named(mjnav, tmp_path):
    (tmp_path / "row.world").write_bytes(world(*ROW, MESH))
    said = mjnav("import", "world", "row.world", "-o", "row.toml", *WAY, "--set", "time_limit=90", "--json")
    assert said.code == 0
    assert said.err == "mjnav: left out: chair: a mesh, neither a cylinder nor a box\n"
    found = json.loads(said.out)
    assert (found["pillars"], found["left_out"]) == (5, ["chair: a mesh, neither a cylinder nor a box"])
    scenario = load(tmp_path / "row.toml")
    assert (scenario.name, scenario.time_limit, scenario.robot.start) == ("row", 90.0, (-1.0, 0.0, 0.0))
    ran = [
        json.loads(mjnav("run", file, *more, "--no-log", *QUICK).out)
        for file, more in (("row.toml", ()), ("row.world", WAY))
    ]
    assert ran[0]["state_hash"] == ran[1]["state_hash"]


def test_mistakes_are_said_in_the_words_of_the_command(mjnav, tmp_path):
    (tmp_path / "row.world").write_bytes(world(*ROW))
    answers = {
        ("import", "world", "row.world", "-o", "a.toml"): "-o needs --start X,Y,HEADING and --goal X,Y",
        ("import", "world", "row.toml"): "found 'row.toml'; allowed: a world, a file that ends in .world or .sdf",
        ("import", "map", "row.world"): "allowed: a map, a file that ends in .yaml or .yml",
        ("import", "world", "row.world", "--people", "3"): "--people needs `import crowd`",
        ("run", "row.world"): "robot: found nothing; allowed: values for robot.start and robot.goal",
        ("run", "row.world", "--start", "1,2"): "argument --start: found '1,2'; allowed: X,Y,HEADING",
        ("run", "row.world", "--start", "-1,0,x"): "argument --start: found '-1,0,x'",
        ("run", "row.world", *WAY[:2], "--goal", "0,0.8"): "--goal: robot.goal: found (0.0, 0.8); allowed: a point",
        ("run", "row.word"): "allowed:",
    }
    for words, answer in answers.items():
        said = mjnav(*words)
        assert (said.code, said.out) == (2, "")
        assert answer in said.err


def test_a_scene_saved_as_a_map_runs_as_a_map_and_its_log_needs_none(mjnav, tmp_path):
    (tmp_path / "row.world").write_bytes(world(*ROW))
    assert mjnav("map", "save", "row.world", "-o", "row.yaml", *WAY, "--resolution", "0.1").code == 0
    said = json.loads(mjnav("import", "map", "row.yaml", "-o", "row.toml", *WAY, "--json").out)
    assert said["wrote"]["walls"] > 5
    assert mjnav("run", "row.yaml", *WAY, "--log", "a.mcap", *QUICK).code == 0
    for name in ("row.yaml", "row.pgm", "row.toml"):
        (tmp_path / name).unlink()
    assert json.loads(mjnav("replay", "a.mcap", "--json").out)["identical"]
    assert mjnav("map", "save", "a.mcap", "-o", "b.yaml", "-q").code == 0
    again = mjnav("map", "save", "a.mcap", "-o", "b.yaml")
    assert (again.code, again.err) == (2, "mjnav: b.yaml: exists already; choose another name\n")
    wrong = mjnav("map", "save", "a.mcap", "-o", "c.yaml", "--resolution", "0.0001")
    assert (wrong.code, "--resolution: found 0.0001" in wrong.err) == (2, True)

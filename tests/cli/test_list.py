"""`mjnav list`."""

import json

from mjnav import control, noise, scene
from mjnav.scene.spec import BEHAVIOURS, ENGINES
from mjnav.study.key_reference import KINDS
from mjnav.study.study_file import studies


def test_it_names_everything_that_a_run_file_may_name(mjnav):
    said = mjnav("list")
    assert (said.code, said.err) == (0, "")
    words = said.out.split()
    for name in (*scene.names(), *studies(), *control.names(), *noise.profile_names(), *BEHAVIOURS):
        assert name in words
    for name in (*noise.CHANNELS, *noise.names(), *ENGINES, "/tf", "/plan"):
        assert name in words
    listed = json.loads(mjnav("list", "--json").out)
    assert list(listed) == ["schema", *(kind.replace(" ", "_") for kind in KINDS)]
    drawn = {name for name, text in listed["scenes"].items() if text.endswith("(drawn by seed)")}
    assert {"rooms", "crowds"} < drawn
    assert not drawn & {"hall", "crossing1"}
    assert all(text.strip() for kind in KINDS for text in listed[kind.replace(" ", "_")].values())


def test_what_packages_register_is_marked_with_the_package(mjnav, tmp_path, monkeypatch):
    package = tmp_path / "arm_planner-1.2.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: arm-planner\nVersion: 1.2\n")
    groups = {
        "controllers": "careful",
        "localizers": "gps",
        "trackers": "joint",
        "behaviours": "jog",
        "distributions": "t",
    }
    lines = [f"[mjnav.{group}]\n{name} = not_importable:Thing" for group, name in groups.items()]
    (package / "entry_points.txt").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    listed = json.loads(mjnav("list", "--json").out)
    text = "from arm-planner 1.2 (not_importable:Thing)"
    assert listed["controllers"]["careful"] == listed["behaviours"]["jog"] == listed["distributions"]["t"] == text
    assert listed["filters"]["robot.localizer.gps"] == listed["filters"]["obstacles.tracker.joint"] == text

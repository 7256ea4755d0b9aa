"""Every scene under every controller, and every noise profile: finite, and the same for the same seed."""

import json

import pytest

from mjnav import control, noise, scene
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario


def summary(*overrides: str, scene: str = "hall", controller: str | None = None) -> dict:
    return Episode(load_scenario(scene, overrides, controller=controller)).run().summary


BASIC = ("crossing1", "crossing2", "crossing3", "five", "hall", "halls", "lane", "table")
WITH_CROWDS = tuple(name for name in scene.names() if name not in (*BASIC, "hall-lidar"))  # test_hall_lidar.py
PUBLISHED = ("crowdnav", "crowdnav-plus", "dsrnn")  # whose people do not see the robot
METHODS = tuple(control.names())


@pytest.mark.parametrize("controller", METHODS)
@pytest.mark.parametrize("scene", BASIC)
def test_a_second_is_finite_and_deterministic(scene, controller):
    first, again = (summary("time_limit=1", scene=scene, controller=controller) for _ in range(2))
    json.dumps(first, allow_nan=False)  # an undefined figure is None
    assert first["state_hash"] == again["state_hash"]
    assert (first["scene"], first["controller"], first["outcome"]) == (scene, controller, "timeout")
    assert first["ticks"] == 10
    assert first["collisions"] == {"person": 0, "table": 0, "wall": 0, "pillar": 0}
    assert first["path_length_m"] > 0.02


@pytest.mark.parametrize(("number", "scene"), tuple(enumerate(sorted({*WITH_CROWDS} - {*PUBLISHED}))))
def test_scenes_with_people_who_react_run_with_both_kinds_of_people(number, scene):
    controller, hashes, seen = METHODS[number % len(METHODS)], set(), {}
    for sees in ("true", "true", "false"):
        figures = summary(
            "time_limit=1",
            "physics.engine=kinematic",
            "stop_on_collision=false",
            f"people_see_robot={sees}",
            scene=scene,
            controller=controller,
        )
        json.dumps(figures, allow_nan=False)
        assert (figures["scene"], figures["outcome"], figures["ticks"]) == (scene, "timeout", 10)
        seen[sees] = figures["people_see_robot"]
        hashes.add(figures["state_hash"])
    assert len(hashes) <= 2  # the same for the same seed
    assert seen["true"] != seen["false"] == "none"


@pytest.mark.parametrize("controller", METHODS)
@pytest.mark.parametrize("scene", PUBLISHED)
def test_two_seconds_of_a_published_crowd_are_finite_under_every_method(scene, controller):
    figures = summary("time_limit=2", scene=scene, controller=controller)
    json.dumps(figures, allow_nan=False)
    assert (figures["outcome"], figures["people_see_robot"]) == ("timeout", "none")
    assert figures["ticks"] == (20 if scene == "dsrnn" else 8)


@pytest.mark.parametrize("scene", ["halls", *WITH_CROWDS])
def test_every_seed_of_a_scene_is_another_layout(scene):
    first, again, other = (load_scenario(scene, seed=seed) for seed in (1, 1, 2))
    assert first == again
    assert [person.start for person in first.people] != [person.start for person in other.people]


@pytest.mark.parametrize("profile", noise.profile_names())
def test_every_noise_profile_gives_finite_figures(profile):
    figures = summary("time_limit=1", f"noise.profile={profile}")
    json.dumps(figures, allow_nan=False)
    assert figures["ticks"] == 10
    assert figures["localization_rmse_m"] < 0.5


@pytest.mark.parametrize("channel", noise.CHANNELS)
def test_every_channel_takes_a_distribution_of_its_own(channel):
    figures = summary("time_limit=0.5", f'noise.{channel}={{distribution="uniform", half_width=0.02}}', scene="lane")
    json.dumps(figures, allow_nan=False)
    assert figures["ticks"] == 5

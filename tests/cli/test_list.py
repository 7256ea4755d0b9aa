"""`mjnav list`."""

import json

from mjnav import control, noise, scenarios
from mjnav.scenarios.spec import BEHAVIOURS
from mjnav.study.study_file import studies


def test_it_names_everything_that_a_run_file_may_name(mjnav):
    said = mjnav("list")
    assert (said.code, said.err) == (0, "")
    words = said.out.split()
    for name in (*scenarios.names(), *studies(), *control.names(), *noise.profile_names(), *BEHAVIOURS):
        assert name in words
    for _, text in scenarios.describe():
        assert text
        assert text in said.out
    assert max(map(len, said.out.splitlines())) <= 120


def test_json_is_one_object(mjnav):
    said = mjnav("list", "--json")
    listed = json.loads(said.out)
    assert list(listed) == ["schema", "scenes", "studies", "controllers", "noise_profiles", "behaviours"]
    assert tuple(listed["scenes"]) == scenarios.names()
    assert listed["studies"] == studies()
    assert tuple(listed["controllers"]) == control.names()
    assert tuple(listed["noise_profiles"]) == noise.profile_names()
    assert set(listed["behaviours"]) == set(BEHAVIOURS)

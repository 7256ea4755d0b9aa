"""What a study file says, and how it is refused."""

import pytest

from mjnav.errors import InvalidValue
from mjnav.study.study_file import MethodEntry, SeedRange, StudyFile, load_study, studies

LEAST = """
schema = 1
name = "least"
scenes = ["crossing1"]
[[methods]]
controller = "rkhs"
"""


@pytest.fixture
def study(tmp_path):
    """Loads a study file of this text."""

    def load(text: str) -> StudyFile:
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return load_study(path)

    return load


def test_the_least_that_a_study_says(study, tmp_path):
    expected = StudyFile(schema=1, name="least", scenes=("crossing1",), methods=(MethodEntry("rkhs"),))
    assert study(LEAST) == expected
    assert (expected.seeds, expected.methods[0].identifier) == (SeedRange(100), "rkhs")
    assert study(LEAST).source == str(tmp_path / "mine.toml")


def test_seeds_are_a_range_or_a_list(study):
    assert study(LEAST.replace("[[", "seeds = { first = 3, count = 4 }\n[[", 1)).all_seeds == range(3, 7)
    assert study(LEAST.replace("[[", "seeds = [9, 2]\n[[", 1)).all_seeds == (9, 2)
    assert study(LEAST.replace("[[", "seeds = [9, 2]\n[[", 1)).with_seeds(3).all_seeds == range(9, 12)


@pytest.mark.parametrize("name", studies())
def test_a_shipped_study_loads_by_name_and_is_named_after_its_file(name):
    assert load_study(name).name == name
    assert "\n" not in studies()[name] != ""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("scenes = ", "scene = ", "scene: found 'scene'; allowed: .*did you mean 'scenes'?"),
        ('["crossing1"]', '["hall", "hall"]', "scenes.1: found 'hall'; allowed: every one once"),
        ('"rkhs"', '"rkhs"\n[[methods]]\ncontroller = "rkhs"', "methods.1: found 'rkhs'; allowed: every one once"),
        ("[[methods]]\n", "seeds = 5\n[[methods]]\n", "seeds: found 5; allowed: an array of whole numbers"),
        ("[[methods]]\n", "seeds = { cuont = 3 }\n[[methods]]\n", "seeds.cuont: .*did you mean 'count'?"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_key(study, tmp_path, old, new, message):
    with pytest.raises(InvalidValue, match=message) as told:
        study(LEAST.replace(old, new, 1))
    assert str(told.value).startswith(f"{tmp_path / 'mine.toml'}: ")

"""What decides an episode's bits is recorded, and what is another is told in words."""

import numpy as np
import pytest

from mjnav.loop.provenance import FACTS, changes, digest, provenance

HERE = provenance("rkhs")


def changed(**facts: str | None) -> dict[str, str | None]:
    return {**HERE, **{fact.replace("_", "."): value for fact, value in facts.items()}}


def test_every_fact_is_known_here():
    assert list(HERE) != []
    assert set(HERE) == set(FACTS)
    assert all(HERE[fact] for fact in FACTS if fact != "sources.controller")
    assert HERE["version.numpy"] == np.__version__
    assert "unknown" not in HERE.values()


@pytest.mark.parametrize("fact", FACTS)
def test_every_fact_that_differs_is_told(fact):
    other = {**HERE, fact: "something else"}
    assert len(changes(HERE, other)) == 1
    assert digest(other) != digest(HERE)


def test_versions_and_features_are_told_as_people_would():
    was = changed(version_numpy="2.4.5", cpu_numpy="X86_V2 X86_V3 X86_V4")
    now = changed(version_numpy="2.4.6", cpu_numpy="X86_V2 ASIMD")
    assert changes(was, now) == (
        "numpy was 2.4.5, is 2.4.6",
        "the processor features that NumPy uses: without X86_V3 X86_V4, with ASIMD",
    )


def test_a_controllers_files_are_told_one_by_one():
    was = changed(sources_controller='{"a.py": "1", "b.py": "2"}')
    now = changed(sources_controller='{"a.py": "3", "c.py": "4"}')
    assert changes(was, now) == ("a.py changed", "b.py is gone", "c.py was added")


def test_what_an_earlier_version_did_not_record_is_one_line():
    (line,) = changes({}, HERE)
    assert line.startswith(
        "written by an earlier version of mjnav, which did not record the digest of mjnav's sources, "
    )
    (line,) = changes(changed(blas=None), HERE)
    assert line.endswith(" did not record BLAS")


@pytest.mark.parametrize("text", ["[1]", "{", "[" * 100_000, '"x"'])
def test_a_record_of_sources_that_is_none_does_no_harm(text):
    assert changes(changed(sources_controller=text), HERE) == ("the record of the plug-ins' sources is gone",)

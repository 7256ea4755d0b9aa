"""The table of figures. That a run and a sweep have these and no other is tested in tests/study/test_trial.py."""

import re

from mjnav.metrics.definitions import HIGHER, LOWER
from mjnav.metrics.summary import DERIVED, FIGURES, GROUPS

UNITS = {"m": "_m", "s": "_s", "ms": "", "rad": "_rad", "m/s": "_m_s", "m/s²": "_m_s2", "m/s³": "_m_s3", "": ""}


def test_each_says_what_it_is_in_which_unit_and_what_is_better():
    for name, one in {**FIGURES, **DERIVED}.items():
        assert one.text, name
        assert one.better in ("", LOWER, HIGHER), name
        if name != "control_cost":  # whose unit is in no name
            assert name.endswith(UNITS[one.unit]), name
        assert not re.search(r"[|\n]", one.line + one.equation), name  # a row of a table


def test_a_group_has_no_name_of_a_figure():
    assert not set(GROUPS) & {*FIGURES, *DERIVED}

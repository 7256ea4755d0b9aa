"""The page of definitions has every figure that a run or a sweep has, under its name, and no other."""

import re
from pathlib import Path

from mjnav.study.compare.cell_figures import PLAIN
from mjnav.study.compare.compare import RATES
from mjnav.study.requirements import run_figures
from mjnav.study.store.row import FIGURES

PAGE = (Path(__file__).parents[2] / "docs" / "method" / "figures.md").read_text(encoding="utf-8")


def test_every_figure_is_defined():
    rows = re.findall(r"^\| (`[^|]*`) \|", PAGE, flags=re.MULTILINE)
    defined = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert len(set(defined)) == len(defined)
    assert set(defined) == (set(FIGURES) | set(run_figures())) - {"error"}
    added = re.findall(r"^`compare` adds `(\w+)`", PAGE, flags=re.MULTILINE)
    assert set(added) == {*RATES, *PLAIN} - set(defined)

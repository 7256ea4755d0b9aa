"""Bars, and words where there are none."""

import numpy as np

from mjnav.control import names
from mjnav.paper import style
from mjnav.paper.bars import bars


def test_gaps_have_a_word_and_titles_say_how_many_episodes_have_a_result(made_up):
    failed = {"success": np.where(np.arange(40) < 1, 1.0, np.nan), "time_to_avoid_s": np.full(40, np.nan)}
    cells = [made_up("rkhs d=1", setting="here", **failed), made_up("kld", setting="here")]
    figure = bars([*cells, made_up("kld", setting="there")], ("rkhs d=1", "kld"), ["control_cost", "time_to_avoid_s"])
    assert [axes.get_title() for axes in figure.axes[:2]] == ["here\nn = 1–40", "there\nn = 40"]
    words = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert words == [[], ["not run"], ["undefined"], ["not run"]]


def test_every_method_has_a_colour_of_its_own():
    assert set(style.METHODS) == set(names())
    assert len(set(style.METHODS.values())) == len(style.METHODS)
    assert len({style.color(label) for label in ("d=1", "d=2", "d=3", "d=2 matched", "d=3 matched", "kld")}) == 6

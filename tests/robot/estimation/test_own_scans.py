"""A tracker of a user's own that goes by scans: what it returns is copied, checked and drawn from."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.errors import PluginFault
from mjnav.messages import Reading
from mjnav.robot.estimation.base import person_track, robot_belief
from mjnav.robot.estimation.own import OwnScanTracker

TRACK = replace(person_track("track7", 0.0, 0.3, np.zeros((5, 4))), age=1.0, unseen=0.5)
READING = Reading(0.5, 0.1, np.zeros(2), 0.0, np.zeros(3), np.zeros((1, 2)), np.ones(4))


class Returning:
    by_scans = True

    def __init__(self, *found):
        self.found, self.given = list(found), None

    def update(self, reading, robot):
        self.given = reading, robot
        return self.found


def update(own):
    return OwnScanTracker("mine.py:Own", own, 3).update(READING, robot_belief(0.5, np.zeros((4, 3))))


def test_it_is_told_the_robots_belief_and_names_its_tracks_itself():
    own = Returning(replace(TRACK, particles=np.zeros((5, 4))), replace(TRACK, name="track12"))
    first, second = update(own)
    assert own.given[1].particles.shape == (4, 3)
    assert (first.name, second.name, first.time, first.age, first.unseen) == ("track7", "track12", 0.5, 1.0, 0.5)
    own.found[0].particles[:] = 9.0  # its own array: the run keeps a copy
    assert not first.particles.any()


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ([TRACK, TRACK], "2 tracks, 1 names"),
        ([replace(TRACK, name="person0")], "named 'person0' in place of"),
        ([replace(TRACK, radius=np.nan)], "radius must be a finite number"),
        ([replace(TRACK, unseen=-1.0)], "unseen must be a finite number >= 0, not -1.0"),
        ([replace(TRACK, weights=np.zeros(5))], "track7: weights must be >= 0 and sum to 1"),
        (["track7"], "returned str in place of tracks"),
    ],
)
def test_what_is_no_track_is_refused_by_the_classs_name(found, said):
    with pytest.raises(PluginFault, match=r"^mine\.py:Own") as refused:
        update(Returning(*found))
    assert said in str(refused.value)

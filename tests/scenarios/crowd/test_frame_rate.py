"""The frame rate of a recording that does not say it."""

import numpy as np
import pytest

from mjnav.scenarios.crowd.reader import read_recording
from mjnav.scenarios.crowd.tracks import guess_frame_rate


@pytest.fixture
def recorded(tmp_path):
    """Twenty people at about 1.3 m/s, of whom every fourth stands; a row every `step` frames of `rate` a second."""

    def recorded(rate, step, *, velocities=False):
        rng = np.random.default_rng(1)
        lines = []
        for person in range(20):
            speed = 0.0 if person % 4 == 0 else rng.normal(1.3, 0.15)
            for frame in range(0, 30 * step, step):
                x = speed * frame / rate
                rest = f"0 {person} {speed} 0 0" if velocities else f"{person}"
                lines.append(f"{frame} {person} {x} {rest}")
        path = tmp_path / "tracks.txt"
        path.write_text("\n".join(lines))
        return read_recording(path)

    return recorded


@pytest.mark.parametrize(("rate", "step"), [(25.0, 10), (15.0, 6), (30.0, 12), (2.5, 1)])
def test_steps_of_two_fifths_of_a_second_are_recognised(recorded, rate, step):
    guess = guess_frame_rate(recorded(rate, step))
    assert (guess.frame_rate, guess.sure) == (rate, True)


def test_recorded_velocities_say_it_exactly(recorded):
    guess = guess_frame_rate(recorded(29.0, 3, velocities=True))
    assert (guess.frame_rate, guess.basis, guess.sure) == (29.0, "the recorded velocities", True)


def test_other_steps_leave_a_guess_that_says_so(recorded):
    guess = guess_frame_rate(recorded(10.0, 1))
    assert not guess.sure
    assert guess.frame_rate == pytest.approx(10.0, rel=0.3)


def test_nobody_in_two_rows_leaves_nothing_to_guess(tmp_path):
    (tmp_path / "a.txt").write_text("0 1 0 0\n0 2 0 0")
    assert guess_frame_rate(read_recording(tmp_path / "a.txt")) is None

"""Predictors of a user's own, and what they may return."""

from dataclasses import replace

import numpy as np
import pytest

import mjnav
from mjnav.errors import MjnavError
from mjnav.prediction import Crowd, Futures

QUICK = {"physics.engine": "kinematic", "time_limit": 0.3}


class Stays:
    """Everybody stays where they are; `spoil` changes what it returns."""

    def __init__(self, scenario, seed, parameters):
        self.num = scenario.prediction.num_steps

    def spoil(self, futures):
        return futures

    def predict(self, crowd: Crowd):
        with pytest.raises(ValueError, match="read-only"):
            crowd.samples[...] = 0.0
        paths = np.repeat(crowd.samples[:, :, None, :2], self.num + 1, axis=2)
        return self.spoil(Futures.along(paths, 0.4))


def test_a_predictor_of_ones_own_decides_where_people_are():
    with mjnav.Simulation(mjnav.load_scenario("crossing1", {**QUICK, "prediction.model": Stays})) as simulation:
        person = simulation.observe().obstacles[0]
    assert (person.future == person.position[:, None]).all()
    assert not person.velocity.any()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda f: None, "predict() returned a NoneType in place of Futures"),
        (lambda f: replace(f, ahead=f.ahead[:, :3]), "ahead has shape (1, 3, 12, 2) in place of (1, 25, 12, 2)"),
        (lambda f: replace(f, position=f.position * np.nan), "position holds a number that is not finite"),
        (lambda f: replace(f, step=0.0), "step must be a finite number > 0, not 0.0"),
    ],
)
def test_a_future_that_is_none_ends_the_run(spoil, said, monkeypatch):
    monkeypatch.setattr(Stays, "spoil", lambda self, futures: spoil(futures))
    with pytest.raises(MjnavError) as raised:
        mjnav.run(mjnav.load_scenario("crossing1", {**QUICK, "prediction.model": Stays}))
    assert said in str(raised.value)

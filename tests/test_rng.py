import numpy as np
import pytest

from mjnav.rng import stream


def test_the_same_triple_gives_the_same_draws():
    assert (stream(7, "pose.x", "robot").random(50) == stream(7, "pose.x").random(50)).all()


@pytest.mark.parametrize(
    ("seed", "channel", "body"),
    [
        (8, "pose.x", "robot"),
        (7, "pose.y", "robot"),
        (7, "pose.x", "person0"),
        (7, "pose", ".xrobot"),
        (7, "pose.xr", "obot"),
    ],
)
def test_another_seed_channel_or_body_gives_other_draws(seed, channel, body):
    assert not (stream(7, "pose.x", "robot").random(50) == stream(seed, channel, body).random(50)).any()


def test_neither_the_order_nor_the_use_of_other_streams_changes_a_stream():
    alone = stream(3, "detection.x", "person1").random(20)
    other, again = stream(3, "detection.y", "person1"), stream(3, "detection.x", "person1")
    interleaved = []
    for _ in range(20):
        other.random(5)
        interleaved.append(again.random())
    stream(3, "a new channel", "person9").random(3)
    assert alone.tolist() == interleaved


def test_streams_are_uncorrelated():
    names = [(channel, body) for channel in ("pose.x", "pose.y", "gyro") for body in ("robot", "person0", "person1")]
    draws = np.array([stream(seed, *name).standard_normal(4000) for seed in (0, 1) for name in names])
    correlation = np.corrcoef(draws) - np.eye(len(draws))
    assert np.abs(correlation).max() < 5.0 / np.sqrt(4000)  # five standard errors

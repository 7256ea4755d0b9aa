"""A recording made up by the tests."""

from pathlib import Path

import numpy as np
import pytest

RATE = 25.0


def made_up(people: int = 8, seconds: float = 30.0, step: int = 10) -> str:
    """Rows of people who cross 12 m x 8 m at about 1.3 m/s in curves, one after the other; the last one stands."""
    rng = np.random.default_rng(3)
    rows = []
    for person in range(people - 1):
        speed, first = rng.uniform(1.0, 1.6), 20.0 * person / people
        y, bend = rng.uniform(0.0, 8.0), rng.uniform(-0.5, 0.5)
        for frame in range(int(first * RATE) // step * step, int(min(first + 12.0 / speed, seconds) * RATE), step):
            way = speed * (frame / RATE - first)
            x = way if person % 2 else 12.0 - way
            rows.append((frame, person + 1, x, y + bend * np.sin(way)))
    rows += [(frame, people, 6.0, 4.0) for frame in range(0, int(seconds * RATE), step)]
    return "\n".join(f"{frame}\t{person}.0\t{x:.5f}\t{y:.5f}" for frame, person, x, y in rows)


@pytest.fixture
def recording(tmp_path) -> Path:
    """A file of `made_up`."""
    path = tmp_path / "recording.txt"
    path.write_text(made_up())
    return path

"""A small learned policy: 19 weights, trained by train.py beside this file.

    mjnav run crossing3 --controller policy.py:Policy

Linear in features made by hand, for an evolution strategy finds few weights quickly (Mania et al. 2018). With φ
the heading in the goal frame, and for each person what comes of straight walking (t the time until the two are closest,
gap the distance of the surfaces then, m where the person then is, seen from the robot, β the bearing now):

    danger = exp(-gap / 0.5 m - t / 2 s)
    v      = tanh(w_v · [1, cos φ, distance, v, Σ danger, Σ danger cos β, near left + near right])
    omega  = tanh(w_ω · [1, sin φ, omega, Σ danger tanh(m_y / 0.3 m), Σ danger sin β, near left - near right])

near = exp(-range / 1 m) of four sectors of the scan to each side, from ahead to behind. When left and right are
exchanged, v stays as it is and omega changes its sign, but for the 1: half as many weights, and no side to unlearn.
"""

from pathlib import Path

import numpy as np

from mjnav.control.policy import PERSON, Features, PolicyController

WEIGHTS = Path(__file__).with_name("weights.npz")

FEATURES = Features(blocks=("robot", "people", "scan"), max_people=5, beams=12)
RIGHT, LEFT = slice(5, 1, -1), slice(6, 10)  # sectors of 30 degrees, from ahead to 120 degrees
LOOKAHEAD = 4.0  # [s] over which people are taken to walk straight on
NUM_SPEED, NUM_TURN = 10, 9

X, Y, VX, VY, CLEARANCE = (PERSON.index(name) for name in ("x", "y", "vx", "vy", "clearance"))


def untrained() -> np.ndarray:
    """Weights of a policy that drives to the goal and sees nobody: where training begins."""
    weights = np.zeros(NUM_SPEED + NUM_TURN)
    weights[1] = 1.0  # faster the better it points to the goal
    weights[NUM_SPEED + 1] = -1.5  # turns to the goal
    return weights


def action(weights: np.ndarray, blocks: dict[str, np.ndarray]) -> np.ndarray:
    """The normalised action (2,) for what the policy sees."""
    distance, cos, sin, v, omega = blocks["robot"][:5].astype(float)
    danger, m_y, bearing = _encounters(blocks["people"].astype(float), v)
    near = np.exp(-blocks["scan"].astype(float))
    speed = [1.0, cos, min(distance, 2.0), v, danger.sum(), danger @ np.cos(bearing), *(near[LEFT] + near[RIGHT])]
    side = [danger @ np.tanh(m_y / 0.3), danger @ np.sin(bearing)]
    turn = [1.0, sin, omega, *side, *(near[LEFT] - near[RIGHT])]
    return np.tanh([weights[:NUM_SPEED] @ speed, weights[NUM_SPEED:] @ turn])


def _encounters(rows: np.ndarray, v: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """danger, m_y [m] and β of each person in the block `people`."""
    people = rows[rows[:, 0] > 0.5]
    position = people[:, [X, Y]]
    relative = people[:, [VX, VY]] - [v, 0.0]  # the robot drives along its own x
    squared = np.maximum((relative**2).sum(axis=1), 1e-6)
    time = np.clip(-(position * relative).sum(axis=1) / squared, 0.0, LOOKAHEAD)
    closest = position + time[:, None] * relative
    radii = np.hypot(*position.T) - people[:, CLEARANCE]
    gap = np.maximum(np.hypot(*closest.T) - radii, 0.0)
    return np.exp(-gap / 0.5 - time / 2.0), closest[:, 1], np.arctan2(position[:, 1], position[:, 0])


class Policy(PolicyController):
    """The policy with the weights in weights.npz."""

    features = FEATURES

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._weights = np.load(WEIGHTS)["weights"]

    def act(self, blocks):
        """(v, omega) for what the policy sees."""
        return self.actions.command(action(self._weights, blocks))

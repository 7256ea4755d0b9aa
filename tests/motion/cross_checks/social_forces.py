"""Forces by PySocialForce, in a process of its own: its import takes over the root logger and writes file.log.

Reads [[positions, velocities], ...] from standard input; prints, for each, Moussaid's forces and Helbing's (1995).
"""

import json
import sys

import numpy as np
from pysocialforce import Simulator
from pysocialforce.fieldofview import FieldOfView
from pysocialforce.forces import SocialForce
from pysocialforce.potentials import PedPedPotential

STEP = 1e-5  # [m] of the differences


def moussaid(position, velocity):
    simulator = Simulator(np.concatenate([position, velocity, position + velocity], axis=1))
    (social,) = [force for force in simulator.forces if isinstance(force, SocialForce)]
    return social.get_force() / social.factor


def helbing(position, velocity):
    """From its potential and field of view: its own gradient of them (PedRepulsiveForce) raises ValueError."""
    potential, speed = PedPedPotential(2.0), np.hypot(*velocity.T)
    ahead, way = velocity / speed[:, None], position[:, None] - position
    force = np.stack(
        [
            (potential.value_r_ab(way - h, speed, ahead) - potential.value_r_ab(way + h, speed, ahead)) / (2.0 * STEP)
            for h in STEP * np.eye(2)
        ],
        axis=-1,
    )
    force[np.diag_indices(len(position))] = 0.0
    return (FieldOfView(100.0, 0.5)(ahead, -force)[..., None] * force).sum(axis=1)


cases = [np.array(case) for case in json.load(sys.stdin)]
print(json.dumps([[moussaid(*case).tolist(), helbing(*case).tolist()] for case in cases]))

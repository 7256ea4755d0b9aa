"""`social_force`: every sample of the crowd walks on under social forces, together with the same sample of all others.

Sample m of each person is taken for one possible crowd. In it everybody wants to keep the velocity w of the sample, as
goals are unknown, and is accelerated by the law of `motion.social_force`:

    a_i = (w_i - v_i) / tau + f_i(people, walls, tables, pillars, the robot),    |v_i| <= excess |w_i|

The forces f_i are constant for SUBSTEP at most, in which the velocity goes towards u = w + tau f = v + tau a exactly:

    v(t) = u + (v - u) exp(-t / tau),    x(t) = x + u t + (v - u) tau (1 - exp(-t / tau)).

Alone in the open, f = 0: the prediction is that of constant velocity. The robot, where it counts, keeps the velocity of
its latest decision. Until the decision takes effect everybody walks straight on.

Where there are more samples than `crowds`, sample m departs from its straight line as sample m modulo `crowds` does.
"""

from math import ceil

import numpy as np

from mjnav.compile.compiled import Cube, Flags, Indices, Matrix, Vector, exact
from mjnav.geometry.floor import floor_of_map
from mjnav.messages import Array, KnownMap
from mjnav.motion.social_force import FORMS, SocialForce, accelerations
from mjnav.robot.prediction.base import Crowd, Futures, carry_people
from mjnav.scene.prediction import Prediction, SocialForceModel

SUBSTEP = 0.2  # [s]
NOBODY = -1  # the robot's place among the bodies, where it does not count


class SocialForces:
    """Rollouts of social forces; no state, no draws."""

    def __init__(self, prediction: Prediction, model: SocialForceModel, seed: int):
        self._step, self._num, self._sees_robot = prediction.step, prediction.num_steps, model.sees_robot
        self._crowds = model.crowds
        self._law = FORMS[model.form]._replace(cut=model.neighbour_range)

    def predict(self, crowd: Crowd) -> Futures:
        """See `Predictor`."""
        position, velocity = carry_people(crowd.samples, crowd.elapsed)
        paths = self._rollouts(crowd, position[:, : self._crowds], velocity[:, : self._crowds])
        num, rolled = position.shape[1], paths.shape[1]
        if num > rolled:
            straight = Futures(position, velocity).paths(self._step, self._num)
            paths = straight + (paths - straight[:, :rolled])[:, np.arange(num) % rolled]
        return Futures(position, velocity, paths[:, :, 1:], self._step)

    def _rollouts(self, crowd: Crowd, position: Array, velocity: Array) -> Array:
        """Paths (P, M, H + 1, 2) of samples (P, M, 2) from the moment of effect on."""
        num_people, num = position.shape[:2]
        robot = crowd.robot if self._sees_robot else None
        bodies = num_people + (robot is not None)
        at, moving = np.empty((num, bodies, 2)), np.empty((num, bodies, 2))
        at[:, :num_people], moving[:, :num_people] = position.swapaxes(0, 1), velocity.swapaxes(0, 1)
        radius = np.array([*(track.radius for track in crowd.tracks), *([] if robot is None else [robot.radius])])
        if robot is not None:
            at[:, -1], moving[:, -1] = robot.position, robot.velocity
        discs, boxes = _obstacles(crowd.map)
        substeps = ceil(self._step / SUBSTEP - 1e-9)
        paths = np.empty((num * num_people, self._num + 1, 2))
        walk(
            paths, at, moving, radius, np.arange(num_people), np.full(num_people, robot is not None),
            NOBODY if robot is None else num_people, discs, boxes, self._law, self._step / substeps, substeps,
        )  # fmt: skip
        return paths.reshape(num, num_people, self._num + 1, 2).swapaxes(0, 1)


def _obstacles(floor: KnownMap | None) -> tuple[Array, Array]:
    """Discs (k, 3) and walls as boxes (l, 6), as in `geometry.floor.Floor`."""
    if floor is None:
        return np.zeros((0, 3)), np.zeros((0, 6))
    bodies = floor_of_map(floor)
    bodies.boxes[:, 4] += bodies.boxes[:, 5]  # a wall has half-square ends
    return bodies.discs, bodies.boxes


@exact
def walk(
    paths: Cube,
    position: Cube,
    velocity: Cube,
    radius: Vector,
    walkers: Indices,
    sees_robot: Flags,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    law: SocialForce,
    step: float,
    substeps: int,
):
    """The paths of M crowds of P people into `paths` (M P, H + 1, 2), the positions at first in them.

    position, velocity (M, B, 2) are changed: the B bodies are the people, and behind them the robot where it counts.
    H steps of `substeps` times `step` [s].
    """
    num_people, tau = len(walkers), law.relaxation_time
    slow = np.exp(-step / tau)
    for m in range(len(position)):
        x, v = position[m], velocity[m]
        wanted = v[:num_people].copy()
        for i in range(num_people):
            paths[m * num_people + i, 0] = x[i]
        for h in range(1, paths.shape[1]):
            for _ in range(substeps):
                a = accelerations(
                    x, v, radius, walkers, wanted, v[:num_people], sees_robot, robot, discs, boxes, law
                )  # fmt: skip
                for i in range(num_people):
                    most = law.excess * np.sqrt(wanted[i, 0] ** 2 + wanted[i, 1] ** 2)
                    ux, uy = v[i, 0] + tau * a[i, 0], v[i, 1] + tau * a[i, 1]
                    vx, vy = ux + (v[i, 0] - ux) * slow, uy + (v[i, 1] - uy) * slow
                    mx = ux * step + (v[i, 0] - ux) * tau * (1.0 - slow)
                    my = uy * step + (v[i, 1] - uy) * tau * (1.0 - slow)
                    speed, way = np.sqrt(vx * vx + vy * vy), np.sqrt(mx * mx + my * my)
                    share = most / speed if speed > most else 1.0
                    part = most * step / way if way > most * step else 1.0
                    v[i, 0], v[i, 1] = share * vx, share * vy
                    x[i, 0], x[i, 1] = x[i, 0] + part * mx, x[i, 1] + part * my
                if robot >= 0:
                    x[robot, 0] += step * v[robot, 0]
                    x[robot, 1] += step * v[robot, 1]
            for i in range(num_people):
                paths[m * num_people + i, h] = x[i]

"""Samples of the lane and collision-cone constraints at every candidate control.

The samples of the lane constraints are safe where <= 0:

    D1 = d1(x) + left offset + margin,   D2 = -(d2(x) + right offset - margin)

at the position x after `lane_horizon`, each with its boundary's noise, the margin being the robot's radius.

F_j(u) are the samples of the collision cone f against disc or wall j at candidate u. With u = (v, omega), robot sample
i moves at

    x'_i(u) = (v + dv_i) [cos(theta_i + (omega + domega_i) tau), sin(...)],

and with sample m of obstacle j it gives one sample of F_j(u),

    f_im(u) = max(f(p_i - o_m, x'_i(u) - o'_m, R_j) / R_j^2, -clip),     i = 1 ... N,  m = 1 ... M;

f is that of `constraints/collision_cone.py` (`constraints/walls.py` for walls), and where `normalise` is false there is
no division by R_j^2. The loops over all pairs are compiled, in `control/kernels/cone_kernel.py`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Matrix, Vector, kernel
from mjnav.constraints.collision_cone import RAY, SEGMENT
from mjnav.constraints.walls import lane_distance
from mjnav.control.kernels.cone_kernel import (
    ConeBlocks,
    ConeRule,
    Controls,
    RobotSamples,
    Samples,
    add_safe,
    cone_moments,
    cone_samples,
    mean_violation,
    velocity_circles,
)
from mjnav.control.parameters import Parameters
from mjnav.messages import Array, Lanes

# ---------------------------------------------------------------------------------------------- lanes


@kernel
def _side(
    out: Matrix,
    v: Vector,
    cos_turn: Vector,
    sin_turn: Vector,
    ahead: Vector,
    across: Vector,
    base: Vector,
    speed_noise: Vector,
    least: float,
):
    """max(base_i + (v_k + dv_i) (ahead_i cos(omega_k tau) - across_i sin(omega_k tau)), least) into `out` (K, N)."""
    for k in range(v.size):
        for i in range(base.size):
            rate = ahead[i] * cos_turn[k] - across[i] * sin_turn[k]
            out[k, i] = max(base[i] + (v[k] + speed_noise[i]) * rate, least)


def lane_samples(
    lanes: Lanes,
    pose: Array,
    noise: Array,
    offsets: tuple[Array, Array],
    v: Array,
    omega: Array,
    margin: float,
    parameters: Parameters,
    *,
    clip: bool = True,
) -> Array:
    """(2, K, N): left and right for controls (K,), poses (N, 3), actuation noise (N, 2) and offsets (N,) each."""
    p = parameters
    out = np.empty((2, len(v), len(pose)))
    heading, turn = pose[:, 2] + noise[:, 1] * p.preview, omega * p.preview
    cos_heading, sin_heading, cos_turn, sin_turn = np.cos(heading), np.sin(heading), np.cos(turn), np.sin(turn)
    speed_noise = np.ascontiguousarray(noise[:, 0])
    unit = 1.0 / margin if p.normalise else 1.0
    for f, line, offset, sign in zip(out, (lanes.left, lanes.right), offsets, (unit, -unit), strict=True):
        # Driving at v changes the distance by v [(a cos + b sin) of the heading after the turn] a second.
        a, b, _ = np.array(line) * (sign * p.lane_horizon / np.hypot(line[0], line[1]))
        base = sign * (lane_distance(pose[:, :2], line) + offset) + unit * margin
        ahead, across = a * cos_heading + b * sin_heading, a * sin_heading - b * cos_heading
        _side(f, v, cos_turn, sin_turn, ahead, across, base, speed_noise, -p.clip if clip else -inf)
    return out


# ------------------------------------------------------------------------------------- collision cone


@dataclass(frozen=True, slots=True)
class SampleCone:
    """All constraint samples of one observation, ready to be evaluated at controls (K,)."""

    blocks: ConeBlocks
    rule: ConeRule
    preview: float  # [s] tau
    robot: RobotSamples

    @classmethod
    def of(cls, blocks: ConeBlocks, rule: ConeRule, robot_pose: Array, control_noise: Array, preview: float):
        """From the robot's samples (N, 3) and their actuation noise (N, 2)."""
        heading = robot_pose[:, 2] + control_noise[:, 1] * preview
        robot = RobotSamples(
            np.array(robot_pose[:, :2], order="C"), control_noise[:, 0].copy(), np.cos(heading), np.sin(heading)
        )
        if rule.form == SEGMENT and rule.horizon == inf:  # a segment without an end
            rule = rule._replace(form=RAY)
        return cls(blocks, rule, preview, robot)

    def raw_moments(self, v: Array, omega: Array, degree: int, hinge: NDArray[np.bool_]) -> Array:
        """The raw moments of F_j(u), means of f^p for p = 1 ... degree: (K, B, degree); of max(0, f) where hinge[b]."""
        out = np.empty((len(self.blocks.column), degree, v.size))
        controls, circles = self._controls(v, omega)
        cone_moments(out, hinge, circles, controls, self.robot, self.blocks, self.rule)
        return out.transpose(2, 0, 1)

    def violation(self, v: Array, omega: Array, shifts: Array) -> Array:
        """sum_b max(0, f_b), (P, K), with the robot moved by each of `shifts` (P, 2); for one sample of everything."""
        out = np.empty((len(shifts), v.size))
        controls, circles = self._controls(v, omega)
        mean_violation(out, shifts, circles, controls, self.robot, self.blocks, self.rule)
        return out

    def samples(self, block: int, v: Array, omega: Array) -> Array:
        """f of one block, (n, K)."""
        controls, circles = self._controls(v, omega)
        out, row = self._memory(int(self.sizes[block]), v.size)
        return self._stored(out, row, block, circles, controls, self.rule).whole()

    def stored_by_block(self, v: Array, omega: Array, *, hinge: bool = False) -> Iterator[Samples]:
        """f of one block after another, in memory that the next overwrites; K is 1 for one out of reach.

        With `hinge` max(0, f), which is less to evaluate.
        """
        out, row = self._memory(int(self.sizes.max(initial=0)), v.size)
        rule = self.rule._replace(floor=max(self.rule.floor, 0.0)) if hinge else self.rule
        controls, circles = self._controls(v, omega)
        for block in range(len(self.blocks.column)):
            samples = self._stored(out, row, block, circles, controls, rule)
            yield samples if len(samples.row) else samples._replace(f=samples.f[:, :1].copy())

    def reduce(self, v: Array, omega: Array, reduction: Callable[[Samples], Array], *, hinge: bool = False) -> Array:
        """(K, B): `reduction` of each block's samples, as `stored_by_block` gives them."""
        out = np.empty((v.size, len(self.blocks.column)))
        for block, samples in enumerate(self.stored_by_block(v, omega, hinge=hinge)):
            out[:, block] = reduction(samples)
        return out

    def add_safe(
        self, sums: Array, counts: NDArray[np.int64], wanted: NDArray[np.bool_], v: Array, omega: Array
    ) -> None:
        """Adds up the safe samples of the `wanted` blocks (B,): f^p to `sums` (B, degree), their number to `counts`."""
        add_safe(sums, counts, wanted, self._controls(v, omega)[0], self.robot, self.blocks, self.rule)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """How many pairs each block has, (B,)."""
        return (self.blocks.start[1:] - self.blocks.start[:-1]) * len(self.robot.speed_noise)

    def _memory(self, num: int, num_controls: int) -> tuple[Array, NDArray[np.int64]]:
        """Room for the samples (n, K) of a block, and for the numbers of their rows."""
        return np.empty((num, num_controls)), np.empty(num, np.int64)

    def _stored(
        self, out: Array, row: NDArray[np.int64], block: int, circles: Array, controls: Controls, rule: ConeRule
    ) -> Samples:
        """The samples of one block, in the memory given."""
        count = cone_samples(out, row, block, circles, controls, self.robot, self.blocks, rule)
        return Samples(out[:count], row[:count], int(self.sizes[block]), rule.floor)

    def _controls(self, v: Array, omega: Array) -> tuple[Controls, Array]:
        """The controls, and circles around the velocities of each robot sample at all of them."""
        turn = omega * self.preview
        controls = Controls(v, np.cos(turn), np.sin(turn))
        return controls, velocity_circles(controls, self.robot)

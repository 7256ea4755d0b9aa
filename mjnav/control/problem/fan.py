"""Rollouts that a planner weighs, and the message that shows its plan and some of these rollouts in a log.

The rollouts are simple ways to begin with, and the planner's own plan, perturbed:

    standing | plan so far | straight to the goal | guides | waiting | escapes | reversing | perturbations of the plan

Guides leave the way to the goal to either side for a while, escapes go off in every direction; each then drives to the
goal. Where the robot may reverse, some back off first. (Rollouts of other controllers among the perturbed: Trevisan &
Alonso-Mora 2024, "Biased-MPPI".)
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from mjnav.control.kernels.guides import guide
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.way_field import WayGrid
from mjnav.messages import Array, PlanShown
from mjnav.rng import stream

FAN = 32  # rollouts shown, at most
NO_VIOLATION = np.zeros(0)  # of a method that has none


def shown_plan(
    rollouts: Rollouts, cost: Array, followed: Rollouts, position: Array, *, feasible: bool, violation: Array
) -> PlanShown:
    """The message of a plan, `followed`, the first of its rollouts, from `position` (2,) [m].

    The fan are FAN of the K `rollouts`, evenly over the order of their `cost` (K,), cheapest first; `violation` (S,) is
    the plan's.
    """
    shown = np.argsort(cost, kind="stable")[np.linspace(0, cost.size - 1, min(FAN, cost.size)).astype(int)]
    return PlanShown(
        step=followed.step,
        path=position + np.stack([followed.x[:, 0], followed.y[:, 0]], axis=-1),
        fan=position + np.stack([rollouts.x[:, shown].T, rollouts.y[:, shown].T], axis=-1),
        fan_cost=cost[shown],
        violation=violation,
        feasible=feasible,
    )


STAND, KEPT = 0, 1  # the first rollouts
SEED = 0  # of the perturbations

SIDEWAYS = np.deg2rad([-75.0, -45.0, -20.0, 0.0, 20.0, 45.0, 75.0])  # of guides, off the way to the goal
SPEEDS = (1.0, 0.6, 0.3)  # of guides, of the preferred speed
HOLDS = (1.6, 3.2)  # [s]
ESCAPES = 2.0 * pi * np.arange(12) / 12  # off the robot's heading
ESCAPE_HOLDS = (1.4, 2.8)  # [s]
WAITS = (0.8, 1.6, 2.4)  # [s]
BACKWARDS = np.deg2rad([-90.0, -45.0, 0.0, 45.0, 90.0])  # off the robot's back


@dataclass(frozen=True, slots=True)
class Plan:
    """Controls for T steps from `time` on."""

    time: float  # [s]
    controls: Array  # (2, T)

    def after(self, passed: float, step: float) -> Array:
        """The controls (2, T) from `passed` [s] later on, between those of two steps; the last is held."""
        at = np.arange(self.controls.shape[1])
        return np.stack([np.interp(at + passed / step, at, u) for u in self.controls])


def carried_on(plan: Plan | None, time: float, step: float, straight: Array) -> Array:
    """The controls (2, T) of a plan moved on to `time` [s].

    Those of the `straight` way where there is no plan, where no time has passed since it was made, or where more has
    than half of its length.
    """
    if plan is None or not 0.0 < time - plan.time <= 0.5 * straight.shape[1] * step:
        return straight
    return plan.after(time - plan.time, step)


def softmin(cost: Array, temperature: float) -> Array:
    """w_k = exp(-(S_k - min S) / temperature) / sum, for costs S (K,)."""
    weights = np.exp((cost.min() - cost) / temperature)
    return weights / weights.sum()


def guides(heading: float, way_direction: float, speed: float, back_speed: float) -> Array:
    """(G, 4) as `kernels.guides` takes them; the first is the straight way. `back_speed` [m/s], 0 without reverse."""
    rows = [(0.0, 0.0, 0.0, speed)]
    rows += [
        (0.0, hold, way_direction + angle, share * speed) for angle in SIDEWAYS for share in SPEEDS for hold in HOLDS
    ]
    rows += [(wait, 0.0, 0.0, speed) for wait in WAITS]
    rows += [(0.0, hold, heading + angle, speed) for angle in ESCAPES for hold in ESCAPE_HOLDS]
    if back_speed > 0.0:
        rows += [(0.0, hold, heading + pi + a, -back_speed) for a in BACKWARDS for hold in ESCAPE_HOLDS]
    return np.array(rows)


def guided(
    rows: Array, pose: Array, way: WayGrid, limits: ControlLimits, approach_time: float, preview: float, step: float,
    steps: int,
) -> Array:  # fmt: skip
    """The controls (2, T, G) of guides (G, 4) from a pose (3,) in the world."""
    out = np.empty((2, steps, len(rows)))
    guide(
        out[0], out[1], rows, pose, way, limits.first, limits.all, limits.change, approach_time, preview, step
    )  # fmt: skip
    return out


def perturbations(num: int, steps: int, knots: int, noise: tuple[float, float], quiet: float = 1.0) -> Array:
    """Perturbations of v and omega, (2, T, num), each followed by its opposite; the same for the same arguments.

    Gaussian at the knots with standard deviations `noise` [m/s, rad/s], linear between them; the knots are spread
    evenly over the steps. Every other pair is scaled by `quiet`.
    """
    at = np.linspace(0.0, knots - 1, steps)
    hat = np.maximum(1.0 - np.abs(at[:, None] - np.arange(knots)), 0.0)  # (T, knots)
    drawn = np.stack([
        std * hat @ stream(SEED, channel, "controller").standard_normal((knots, (num + 1) // 2))
        for channel, std in zip(("mppi.v", "mppi.omega"), noise, strict=True)
    ])  # fmt: skip
    drawn[:, :, 1::2] *= quiet
    return np.stack([drawn, -drawn], axis=-1).reshape(2, steps, -1)[:, :, :num]

"""What a page shows of a method that plans ahead: its plan, the rollouts beside it, the violation of its samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array, PlanShown
from mjnav.report.run_page.candidate_ranks import NONE
from mjnav.report.run_page.packed import Packer

MAX_POINTS = 40  # kept of the plan, evenly over its time
FAN_POINTS = 8  # of each rollout of the fan; the last is its end
MAX_FAN = 32
STEP = 1e-3  # [m]
FINEST = 0.01  # [m] step of a move of the fan from point to point
BIN = 0.1  # width of the histogram's bins
NUM_BINS = 20  # up to MOST
MOST = 2.0  # of a violation
CONTACT = 1.0  # violation from which a sample touches


@dataclass(frozen=True, slots=True)
class ShownPlan:
    """A plan as a page keeps it."""

    path: Array  # (P, 2) [m]
    fan: Array  # (F, Q, 2) [m], cheapest first
    after: float  # [s] from point to point of the path
    feasible: bool
    shares: Array | None  # (NUM_BINS + 1,) of samples at 0, then in each bin from its low end on; None without samples
    touching: float  # share of samples at CONTACT or more

    @classmethod
    def of(cls, plan: PlanShown) -> "ShownPlan":
        """Of what the log has."""
        num = len(plan.path)
        kept, few = (np.linspace(0, max(num - 1, 0), min(num, most)).astype(int) for most in (MAX_POINTS, FAN_POINTS))
        after = plan.step * (num - 1) / (len(kept) - 1) if len(kept) > 1 else plan.step
        shares, touching = None, np.nan
        if (h := plan.violation).size:
            bins = np.nan_to_num(np.clip(h, 0.0, MOST)) / BIN
            place = np.where(bins > 0.0, np.minimum(bins + 1.0 + 1e-6, NUM_BINS), 0.0).astype(int)
            shares, touching = np.bincount(place, minlength=NUM_BINS + 1) / h.size, float((h >= CONTACT).mean())
        return cls(plan.path[kept], plan.fan[:MAX_FAN, few], after, plan.feasible, shares, touching)


def pack_plans(packer: Packer, plans: Mapping[int, ShownPlan], num_frames: int) -> dict[str, Any] | None:
    """Adds the arrays of plans by frame; gives what holds for the whole run, None where no frame has a plan.

    Arrays: `plan` (T, P, 2) and `plan_feasible` (T,); `fan` (T, F, Q, 2), moves from point to point, the first from the
    plan's first point; `violation` (T, bins) in 255ths, more than none is at least one, and `violation_shares` (T, 2)
    at 0 and at a contact or more.
    """
    plans = {frame: plan for frame, plan in plans.items() if len(plan.path)}
    if not plans:
        return None
    paths = np.full((num_frames, max(len(plan.path) for plan in plans.values()), 2), np.nan)
    fans = np.full((num_frames, max(len(plan.fan) for plan in plans.values()), FAN_POINTS, 2), np.nan)
    feasible = np.full(num_frames, NONE, np.uint8)
    violation = np.zeros((num_frames, NUM_BINS + 1), np.uint8)
    shares = np.full((num_frames, 2), np.nan)
    for frame, plan in plans.items():
        paths[frame, : len(plan.path)] = plan.path
        fans[frame, : len(plan.fan), : plan.fan.shape[1]] = plan.fan - plan.path[0]
        feasible[frame] = plan.feasible
        if plan.shares is not None:
            violation[frame] = _codes(plan.shares)
            shares[frame] = plan.shares[0], plan.touching
    packer.measured("plan", paths, STEP)
    packer.numbers("plan_feasible", feasible)
    _pack_fans(packer, fans)
    has_samples = bool(np.isfinite(shares).any())
    if has_samples:
        packer.numbers("violation", violation)
        packer.measured("violation_shares", shares, STEP)
    return {
        "after": float(np.median([plan.after for plan in plans.values()])),  # [s]
        "fan": list(fans.shape[1:3]),
        "bin": BIN,
        "violation": has_samples,
    }


def _codes(shares: Array) -> NDArray[np.uint8]:
    return np.ceil(255 * shares - 0.5 * (shares > 1 / 255)).astype(np.uint8)


def _pack_fans(packer: Packer, fans: Array) -> None:
    """Positions (T, F, Q, 2) about the plan's first point as moves whose rounding errors do not add up."""
    moves = np.abs(np.diff(fans, axis=2, prepend=0.0))
    step = max(FINEST, float(np.nanmax(moves, initial=0.0)) / 127.0)
    packer.offsets("fan", np.diff(np.rint(fans / step), axis=2, prepend=0.0) * step, step)

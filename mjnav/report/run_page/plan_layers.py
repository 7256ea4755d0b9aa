"""Layers of a run's page about the future: the ranks of candidates, the plan, and the predicted ways of people.

A tick's candidates are kept as the window that they cover, and the rank of each candidate in eight levels. Where the
candidates are a grid over (v, omega), the window and the ranks are enough; of a method whose candidates are no grid,
some candidates are kept with their own controls.

Of a method that plans ahead, the page shows its plan, the rollouts beside it, and the violation of its samples.

Of how people are predicted to go on, the page draws a few points of each way that /scene holds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.log.encode.candidates import NUM_LEVELS, level_bounds
from mjnav.log.encode.plan import MOST_PEOPLE, MOST_SAMPLES, SUFFIX
from mjnav.messages import Array, PlanShown
from mjnav.report.run_page.packed import Packer

# ----------------------------------------------------------------------------------------- candidates


MAX_FREE = 96  # arcs kept of candidates that are no grid
NONE = 255  # where there is no arc

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class CandidateRanks:
    """One tick's. `level` goes from 0, the cheapest eighth, to 7."""

    window: Array  # (4,) lowest and highest v [m/s], lowest and highest omega [rad/s]
    level: Bytes  # (num_v * num_omega,) of a grid, omega fastest; else (n,)
    free: Bytes | None = None  # (n, 2) shares of the window in 255ths; None for a grid


def candidate_ranks(v: Array, omega: Array, total: Array, shape: tuple[int, int]) -> CandidateRanks | None:
    """The ranks of the total costs of K candidates, each array (K,).

    `shape` is the grid that they may be, (num_v, num_omega), before keep and brake. None where the robot cannot move
    and no arc has a length. Raises ValueError where the arrays differ in length or are empty.
    """
    if not v.size == omega.size == total.size > 0:
        raise ValueError(f"{v.size} speeds, {omega.size} turn rates and {total.size} costs")
    if not v.any():
        return None
    order = np.argsort(total, kind="stable")
    level = np.empty(v.size, np.uint8)
    level[order] = np.repeat(np.arange(NUM_LEVELS, dtype=np.uint8), np.diff(level_bounds(v.size)))
    num_v, num_omega = shape
    if v.size == num_v * num_omega + 2:
        rows, columns = v[:-2].reshape(shape), omega[:-2].reshape(shape)
        if (rows == rows[:, :1]).all() and (columns == columns[:1]).all():
            return CandidateRanks(np.array([rows[0, 0], rows[-1, 0], columns[0, 0], columns[0, -1]]), level[:-2])
    window = np.array([v.min(), v.max(), omega.min(), omega.max()])
    kept = order[np.linspace(0, v.size - 1, min(v.size, MAX_FREE)).astype(int)]
    low, size = window[[0, 2]], np.maximum(window[[1, 3]] - window[[0, 2]], 1e-9)
    shares = (np.stack([v, omega], axis=-1)[kept] - low) / size
    return CandidateRanks(window, level[kept], np.rint(255 * np.clip(shares, 0.0, 1.0)).astype(np.uint8))


# ---------------------------------------------------------------------------------------------- plans


MAX_POINTS = 40  # kept of the plan, evenly over its time
FAN_POINTS = 8  # of each rollout of the fan; the last is its end
MAX_FAN = 32
STEP = 1e-3  # [m]
FINEST_FAN = 0.01  # [m] step of a move of the fan from point to point
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
    step = max(FINEST_FAN, float(np.nanmax(moves, initial=0.0)) / 127.0)
    packer.offsets("fan", np.diff(np.rint(fans / step), axis=2, prepend=0.0) * step, step)


# ----------------------------------------------------------------------------------- predicted people


POINTS = 5  # kept of a way, evenly over its time; the first is where the sample is now
FINEST_WAY = 0.01  # [m] step of a move from point to point

Ways = Mapping[str, Array]  # track -> (MOST_SAMPLES, POINTS, 2) [m]


def predicted_ways(update: Any) -> Ways:
    """The predicted ways in a foxglove.SceneUpdate; NaN where a track has fewer than MOST_SAMPLES."""
    entities = [entity for entity in update.entities if entity.id.endswith(SUFFIX)]
    return {entity.id.removesuffix(SUFFIX): _samples(entity.lines) for entity in entities[:MOST_PEOPLE]}


def _samples(lines: Sequence[Any]) -> Array:
    samples = np.full((MOST_SAMPLES, POINTS, 2), np.nan)
    for sample, line in zip(samples, lines, strict=False):
        if (number := len(line.points)) > 0:
            places = np.linspace(0, number - 1, POINTS).round().astype(int).tolist()
            sample[:] = [(line.points[place].x, line.points[place].y) for place in places]
    return samples


def pack_ways(packer: Packer, ways: Mapping[int, Ways], tracks: Sequence[str], positions: Array) -> None:
    """Adds the ways by frame, as moves from point to point, the first from the track's position; nothing without ways.

    `positions` are those of all tracks, (T, tracks, 2) [m].
    """
    if not ways:
        return
    moves = np.full((len(positions), MOST_PEOPLE, MOST_SAMPLES, POINTS, 2), np.nan)
    owners = np.full((len(positions), MOST_PEOPLE), NONE, np.uint8)
    for frame, found in ways.items():
        for place, (name, samples) in enumerate(found.items()):
            if name in tracks[:NONE]:
                owners[frame, place] = track = tracks.index(name)
                start = np.broadcast_to(positions[frame, track], (MOST_SAMPLES, 1, 2))
                moves[frame, place] = np.diff(np.concatenate([start, samples], axis=1), axis=1)
    sizes = np.abs(moves[np.isfinite(moves)])
    packer.numbers("way_of", owners)
    packer.offsets("ways", moves, max(FINEST_WAY, float(np.quantile(sizes, 0.999)) / 127.0 if sizes.size else 0.0))

"""What a page shows of each tick beside the states: samples, candidates, plans, predictions, lidar and consistency.

Arrays in a page are compact text that a few lines of JavaScript turn back into numbers (web/unpack.js). Measured
columns are whole multiples of a step, as 16-bit codes of their change from row to row. What moves smoothly becomes
small codes, low and high bytes stand apart, and gzip packs that well.

The samples F and F^des of every tick become histograms over one common axis.

A tick's candidates are kept as the window that they cover, and the rank of each candidate in eight levels. Where the
candidates are a grid over (v, omega), the window and the ranks are enough; of a method whose candidates are no grid,
some candidates are kept with their own controls.

Of a method that plans ahead, the page shows its plan, the rollouts beside it, and the violation of its samples. Of how
people are predicted to go on, it draws a few points of each way that /scene holds.

Where the robot goes by its lidar, the page also shows scans, detections, the lives of tracks, and the robot's map.
"""

import gzip
from base64 import b64encode
from collections.abc import Mapping, Sequence
from math import tau
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.log.encode.plan import MOST_PEOPLE, MOST_SAMPLES
from mjnav.messages import Array, PlanShown, Trajectory
from mjnav.metrics.consistency import COVERED, people_nees, region, robot_nees, robot_particles
from mjnav.report.run_page.run_frames import POINTS, RunFrames, Ways
from mjnav.scene.spec import Scenario

# -------------------------------------------------------------------------------------- packed arrays


_MAX_CODE = 65534  # of a 16-bit code; the next is NaN
_MAX_OFFSET = 127  # of a signed byte; -128 is NaN
LARGEST = 1e100  # of a measured number: differences of such are finite, too
_ALIGNMENT = 8  # [bytes] so that every array begins where doubles may


class Packer:
    """Collects named arrays whose first axis is time; `packed` is the document for the page."""

    def __init__(self):
        self._fields: dict[str, dict[str, Any]] = {}
        self._data: list[bytes] = []
        self._size = 0

    def measured(self, name: str, values: ArrayLike, step: float) -> None:
        """Numbers (T, ...) to the nearest multiple of `step`, or of what their range needs; NaN is kept.

        What is beyond LARGEST is NaN, too: nothing that was measured.
        """
        values = np.asarray(values, float)
        known = np.abs(values) <= LARGEST
        low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
        step = max(step, (high - low) / (_MAX_CODE - 1))
        low = np.floor(low / step) * step
        codes = np.full(values.shape, _MAX_CODE + 1)
        codes[known] = np.rint((values[known] - low) / step)
        columns = codes.reshape(len(codes), -1).T
        change = np.diff(columns, axis=1, prepend=0).astype(np.uint16)  # modulo 2^16, as the page's sum is
        planes = np.stack([change & 0xFF, change >> 8]).astype(np.uint8)
        self._add(name, planes, "measured", values.shape, low=float(low), step=float(step))

    def offsets(self, name: str, values: ArrayLike, step: float) -> None:
        """Small numbers (T, ...) about zero, a byte each; what is beyond 127 steps is brought to it, NaN is kept."""
        values = np.asarray(values, float)
        known = np.isfinite(values)
        codes = np.full(values.shape, -_MAX_OFFSET - 1)
        codes[known] = np.clip(np.rint(values[known] / step), -_MAX_OFFSET, _MAX_OFFSET)
        self._add(name, codes.astype(np.int8), "offsets", values.shape, step=step)

    def numbers(self, name: str, values: NDArray[np.uint8] | NDArray[np.float32] | NDArray[np.float64]) -> None:
        """Numbers (T, ...) as they are."""
        self._add(name, values, values.dtype.name, values.shape)

    def _add(self, name: str, data: np.ndarray, kind: str, shape: tuple[int, ...], **more: float) -> None:
        content = np.ascontiguousarray(data, data.dtype.newbyteorder("<")).tobytes()
        content += bytes(-len(content) % _ALIGNMENT)
        self._fields[name] = {"kind": kind, "shape": list(shape), "offset": self._size, **more}
        self._data.append(content)
        self._size += len(content)

    def packed(self) -> dict[str, Any]:
        """Each array's kind, shape and place, and all of them as base64 of gzip."""
        data = gzip.compress(b"".join(self._data), 9, mtime=0)
        return {"fields": self._fields, "gzip": b64encode(data).decode()}


Bytes = NDArray[np.uint8]
STEP = 1e-3  # m, rad
NONE = 255  # of a code: nothing


def share_codes(shares: Array) -> Bytes:
    """Shares in 255ths; more than none is at least one."""
    return np.ceil(255 * shares - 0.5 * (shares > 1 / 255)).astype(np.uint8)


# ------------------------------------------------------------------------------ histograms of samples


CONE_BINS = 36  # at least; one edge is zero, where safe ends
LOWEST = 0.005  # quantile of all samples where the axis begins: a few that are very safe would squeeze all others


def cone_bins(cones: Mapping[int, tuple[Array, Array]], num_frames: int) -> tuple[float, float, Bytes] | None:
    """The histograms of (samples, desired) by frame: low, width, and shares (T, 2, B); None where no frame has any.

    Bin i holds low + i width < f <= low + (i + 1) width, the first also what lies below. Shares of F and F^des are in
    255ths, more than none is at least one.
    """
    every = np.concatenate([part for pair in cones.values() for part in pair]) if cones else np.zeros(0)
    every = every[np.abs(every) <= LARGEST]
    if not every.size:
        return None
    low, high = min(float(np.quantile(every, LOWEST)), -1e-3), max(float(every.max()), 1e-3)
    width = (high - low) / CONE_BINS
    num_safe, num_unsafe = int(np.ceil(-low / width - 1e-9)), int(np.ceil(high / width - 1e-9))
    edges = width * np.arange(-num_safe, num_unsafe + 1)
    shares = np.zeros((num_frames, 2, num_safe + num_unsafe), np.uint8)
    for frame, pair in cones.items():
        for row, part in enumerate(pair):
            if part.size:
                place = np.clip(np.searchsorted(edges, part, side="left") - 1, 0, len(edges) - 2)
                share = np.bincount(place, minlength=len(edges) - 1) / part.size
                shares[frame, row] = share_codes(share)
    return -num_safe * width, width, shares


# ---------------------------------------------------------------------------------------------- plans


MAX_POINTS = 40  # kept of the plan, evenly over its time
FAN_POINTS = 8  # of each rollout of the fan; the last is its end
MAX_FAN = 32
FINEST_FAN = 0.01  # [m] step of a move of the fan from point to point
BIN = 0.1  # width of the histogram's bins
NUM_BINS = 20  # up to MOST
MOST = 2.0  # of a violation
CONTACT = 1.0  # violation from which a sample touches


def pack_plans(packer: Packer, plans: Mapping[int, PlanShown], num_frames: int) -> dict[str, Any] | None:
    """Adds the arrays of plans by frame; gives what holds for the whole run, None where no frame has a plan.

    Arrays: `plan` (T, P, 2) and `plan_feasible` (T,); `fan` (T, F, Q, 2), cheapest first, moves from point to point, of
    which the first is from the plan's first point; `violation` (T, bins) in 255ths, the share of samples at 0, then in
    each bin, and `violation_shares` (T, 2) at 0 and at a contact or more.
    """
    plans = {frame: plan for frame, plan in plans.items() if len(plan.path)}
    if not plans:
        return None
    num_rollouts = min(MAX_FAN, max(len(plan.fan) for plan in plans.values()))
    paths = np.full((num_frames, min(MAX_POINTS, max(len(plan.path) for plan in plans.values())), 2), np.nan)
    fans = np.full((num_frames, num_rollouts, FAN_POINTS, 2), np.nan)
    feasible = np.full(num_frames, NONE, np.uint8)
    violation = np.zeros((num_frames, NUM_BINS + 1), np.uint8)
    shares = np.full((num_frames, 2), np.nan)
    for frame, plan in plans.items():
        path = plan.path[_evenly(len(plan.path), MAX_POINTS)]
        fan = plan.fan[:MAX_FAN, _evenly(len(plan.path), FAN_POINTS)]
        paths[frame, : len(path)] = path
        fans[frame, : len(fan), : fan.shape[1]] = fan - path[0]
        feasible[frame] = plan.feasible
        if (h := plan.violation).size:
            bins = np.nan_to_num(np.clip(h, 0.0, MOST)) / BIN
            place = np.where(bins > 0.0, np.minimum(bins + 1.0 + 1e-6, NUM_BINS), 0.0).astype(int)
            share = np.bincount(place, minlength=NUM_BINS + 1) / h.size
            violation[frame] = share_codes(share)
            shares[frame] = share[0], (h >= CONTACT).mean()
    packer.measured("plan", paths, STEP)
    packer.numbers("plan_feasible", feasible)
    _pack_fans(packer, fans)
    has_samples = bool(np.isfinite(shares).any())
    if has_samples:
        packer.numbers("violation", violation)
        packer.measured("violation_shares", shares, STEP)
    return {"fan": list(fans.shape[1:3]), "bin": BIN, "violation": has_samples}


def _evenly(num: int, most: int) -> NDArray[np.intp]:
    """The places of at most `most` of `num` points, evenly over them, the last among them."""
    return np.linspace(0, max(num - 1, 0), min(num, most)).astype(np.intp)


def _pack_fans(packer: Packer, fans: Array) -> None:
    """Positions (T, F, Q, 2) about the plan's first point as moves whose rounding errors do not add up."""
    moves = np.abs(np.diff(fans, axis=2, prepend=0.0))
    step = max(FINEST_FAN, float(np.nanmax(moves, initial=0.0)) / 127.0)
    packer.offsets("fan", np.diff(np.rint(fans / step), axis=2, prepend=0.0) * step, step)


# ----------------------------------------------------------------------------------- predicted people


FINEST_WAY = 0.01  # [m] step of a move from point to point


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


# ---------------------------------------------------------------------------------------------- lidar


MAX_BEAMS = 180  # of a scan, evenly over its beams
MAX_DETECTIONS = 16  # of a scan
RANGE_STEP = 0.02  # [m]
LIFE_STEP = 0.01  # s, m, or of a track's number


def pack_lidar(packer: Packer, frames: RunFrames, scenario: Scenario, tracks: Sequence[str]) -> dict[str, Any]:
    """Adds the layers' arrays; gives what holds for the whole run.

    Arrays: `life` (T, tracks, 4) number, age [s], time unseen [s] and radius [m] of each track; `detected` (T, n, 6) x,
    y, radius, semi-axes and direction of the 95 % ellipse; `scan` (S, beams) ranges of each scan, `scan_time` (S,) when
    its first beam was taken, and `scan_of` (T,) the number of each frame's scan.
    """
    lives = [frames.array(f"life {name}", 4) for name in tracks]
    packer.measured("life", np.stack(lives, axis=1) if lives else np.empty((len(frames), 0, 4)), LIFE_STEP)
    _pack_detections(packer, frames)
    lidar = scenario.sensors.scanner
    every = max(1, -(-len(lidar.angles) // MAX_BEAMS))
    angles = lidar.angles[::every]
    _pack_scans(packer, frames, every, len(angles))
    return {
        "first": round(float(angles[0]), 6),  # [rad]
        "step": round(float(np.diff(angles[:2]).sum()), 8),  # [rad]
        "pause": 0.0 if lidar.rate is None else round(float(np.diff(angles[:2]).sum()) / (tau * lidar.rate), 8),  # [s]
        "mount": lidar.mount.tolist(),
        "longest": scenario.sensors.longest_pause,  # [s] that a track may be unseen between two scans
    }


def _pack_detections(packer: Packer, frames: RunFrames) -> None:
    number = min(MAX_DETECTIONS, max(map(len, frames.detections.values()), default=0))
    rows = np.full((len(frames), number, 6), np.nan)
    for frame, found in frames.detections.items():
        rows[frame, : len(found)] = found[:number]
    packer.measured("detected", rows, STEP)


def _pack_scans(packer: Packer, frames: RunFrames, every: int, beams: int) -> None:
    """A scan that more than one frame shows is there once."""
    scans = sorted(frames.scans.items())
    ranges = np.full((max(1, len(scans)), beams), np.nan)
    for row, (_, scan) in zip(ranges, scans, strict=False):
        shown = scan.ranges[::every][:beams]
        row[: len(shown)] = np.where(np.isfinite(shown), shown, np.nan)
    packer.measured("scan", ranges, RANGE_STEP)
    packer.numbers("scan_time", np.array([scan.first for _, scan in scans] or [np.nan]))
    taken = np.array([frame for frame, _ in scans])
    latest = np.searchsorted(taken, np.arange(len(frames)), side="right") - 1.0
    packer.measured("scan_of", np.where(latest >= 0.0, latest, np.nan), 1.0)


# --------------------------------------------------------------------------------------- consistency


MOST_NEES = 1e6  # over its bound: what is infinite is drawn there


def pack_consistency(
    packer: Packer, trajectory: Trajectory, scenario: Scenario, rows: NDArray[np.intp], people_ess: Array
) -> None:
    """Packs `nees`, the NEES of the robot and the largest of people's over the bound of their 95 % region, (F, 2).

    And `ess`, the effective sample size of the robot's belief and the least of people's over the number of particles,
    (F, 2). `rows` are the frames' rows of the trajectory, of which the last is the state at its end; `people_ess` is
    the least of people's at each frame.
    """
    largest = np.fmax.reduce(people_nees(trajectory), axis=1, initial=np.nan) / region(COVERED, 4)
    nees = np.column_stack([robot_nees(trajectory) / region(COVERED, 3), largest])
    robot = trajectory.robot_ess / robot_particles(trajectory, scenario)
    ess = np.column_stack([_at(robot, rows), people_ess / scenario.estimation.obstacles.particles])
    packer.numbers("nees", np.minimum(_at(nees, rows), MOST_NEES).astype(np.float32))
    packer.numbers("ess", ess.astype(np.float32))


def _at(values: Array, rows: NDArray[np.intp]) -> Array:
    """The rows of a figure of ticks; NaN for the state at the end."""
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])[rows]

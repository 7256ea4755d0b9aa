"""Layers of a run's page: histograms of the constraint's samples, lidar data, and the likelihood of positions.

The samples F and F^des of every tick become histograms over one common axis.

Where the robot goes by its lidar, the page also shows scans, detections, the lives of tracks, and the robot's map.

The likelihood of a scan is given at positions around the believed one, by the localizer's likelihood field.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.report.lidar_view import BelievedWay, ShownScan, range_noise, scan_points
from mjnav.report.run_page.packed import LARGEST, Packer
from mjnav.report.run_page.run_frames import RunFrames
from mjnav.report.scene_outline import body_outline
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.robot.estimation.lidar.localizer import TEMPER
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar

# ------------------------------------------------------------------------------ histograms of samples


NUM_BINS = 36  # at least; one edge is zero, where safe ends
LOWEST = 0.005  # quantile of all samples where the axis begins: a few that are very safe would squeeze all others


@dataclass(frozen=True, slots=True)
class ConeBins:
    """Shares of samples; bin i holds low + i width < f <= low + (i + 1) width, the first also what lies below."""

    low: float
    width: float
    shares: NDArray[np.uint8]  # (T, 2, B) of F and F^des in 255ths, more than none is at least one


def cone_bins(cones: Mapping[int, tuple[Array, Array]], num_frames: int) -> ConeBins | None:
    """The histograms of (samples, desired) by frame; None where no frame has any."""
    every = np.concatenate([part for pair in cones.values() for part in pair]) if cones else np.zeros(0)
    every = every[np.abs(every) <= LARGEST]
    if not every.size:
        return None
    low, high = min(float(np.quantile(every, LOWEST)), -1e-3), max(float(every.max()), 1e-3)
    width = (high - low) / NUM_BINS
    num_safe, num_unsafe = int(np.ceil(-low / width - 1e-9)), int(np.ceil(high / width - 1e-9))
    edges = width * np.arange(-num_safe, num_unsafe + 1)
    shares = np.zeros((num_frames, 2, num_safe + num_unsafe), np.uint8)
    for frame, pair in cones.items():
        for row, part in enumerate(pair):
            if part.size:
                place = np.clip(np.searchsorted(edges, part, side="left") - 1, 0, len(edges) - 2)
                share = np.bincount(place, minlength=len(edges) - 1) / part.size
                shares[frame, row] = np.ceil(255 * share - 0.5 * (share > 1 / 255))
    return ConeBins(-num_safe * width, width, shares)


# ---------------------------------------------------------------------------------------------- lidar


MAX_BEAMS = 180  # of a scan, evenly over its beams
MAX_DETECTIONS = 16  # of a scan
RANGE_STEP = 0.02  # [m]
LIFE_STEP = 0.01  # s, m, or of a track's number
STEP = 1e-3  # m, rad


def pack_lidar(
    packer: Packer, frames: RunFrames, scenario: Scenario, tracks: Sequence[str], way: BelievedWay
) -> dict[str, Any]:
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
    believed, ellipse = frames.array("estimate", 3), frames.array("ellipse", 3)
    return {
        "side": SIDE if pack_likelihood(packer, scenario, frames.scans, way, believed, ellipse) else 0,
        "first": round(float(angles[0]), 6),  # [rad]
        "step": round(float(np.diff(angles[:2]).sum()), 8),  # [rad]
        "pause": 0.0 if lidar.rate is None else round(float(np.diff(angles[:2]).sum()) / (tau * lidar.rate), 8),  # [s]
        "mount": lidar.mount.tolist(),
        "longest": scenario.sensors.longest_pause,  # [s] that a track may be unseen between two scans
        "map": None if scenario.estimation.map is None else body_outline(scenario.known_bodies),
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


# ---------------------------------------------------------------------------- likelihood of positions


SIDE = 15  # cells along each axis
LEVELS = 16  # of a cell: 0 is nothing, the last one the likeliest
DEPTH = 8.0  # natural logarithms from the likeliest cell down to none
REACHES = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2)  # [m] to each side, whichever holds the belief
HELD = 1.5  # times the longer semi-axis of the 95 % ellipse, at least


def pack_likelihood(
    packer: Packer,
    scenario: Scenario,
    scans: Mapping[int, ShownScan],
    way: BelievedWay,
    believed: Array,
    ellipse: Array,
) -> bool:
    """Adds `likelihood` (S, SIDE^2), rows from low y and x on, and `reach` (S,) [m] of each scan; whether it could.

    `believed` (T, 3) and `ellipse` (T, 3) are those of the frames that show the `scans`. Nothing is added where the law
    of ranges is somebody's own, or the map is empty.
    """
    noise = range_noise(scenario)
    if noise is None or not scans:
        return False
    field = LikelihoodField.of(floor_of_lidar(scenario.known_bodies), scenario.sensors.scanner, noise)
    if field.is_empty:
        return False
    cells = list(_cells(field, scans, way, believed, ellipse))
    packer.numbers("likelihood", np.array([levels for levels, _ in cells], np.uint8))
    packer.numbers("reach", np.array([reach for _, reach in cells], np.float32))
    return True


def _cells(
    field: LikelihoodField, scans: Mapping[int, ShownScan], way: BelievedWay, believed: Array, ellipse: Array
) -> Iterator[tuple[NDArray[np.uint8], float]]:
    for frame, scan in sorted(scans.items()):
        pose, longer = believed[frame], HELD * ellipse[frame, 0]
        reach = next((reach for reach in REACHES if reach >= longer), REACHES[-1])
        if np.isfinite(pose).all():
            points = scan_points(scan, field.lidar, way) - pose[:2]
            c, s = np.cos(pose[2]), np.sin(pose[2])
            yield likelihood_levels(field, points @ np.array([[c, -s], [s, c]]), pose, reach), reach
        else:
            yield np.zeros(SIDE * SIDE, np.uint8), reach


def likelihood_levels(field: LikelihoodField, points: Array, pose: Array, reach: float) -> NDArray[np.uint8]:
    """Levels (SIDE^2,) of the likelihood at positions up to `reach` [m] around a pose (3,), at its heading.

    `points` (n, 2) are where beams ended, in the robot's frame. Equal steps of level are equal factors of likelihood,
    which counts as it does in the localizer.
    """
    steps = np.linspace(-reach, reach, SIDE)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    poses = np.column_stack([pose[:2] + offsets, np.full(len(offsets), pose[2])])
    beams = field.beams(np.ascontiguousarray(points), spread=0.5 * float(steps[1] - steps[0]))
    fit = TEMPER * field.log_ratio(poses, beams)
    return np.rint((LEVELS - 1) * np.maximum(0.0, 1.0 + (fit - fit.max()) / DEPTH)).astype(np.uint8)

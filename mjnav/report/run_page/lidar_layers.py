"""What a page shows beside the rest where the robot goes by its lidar: scans, detections, tracks' lives, its map."""

from collections.abc import Sequence
from math import tau
from typing import Any

import numpy as np

from mjnav.report.run_page.packed import Packer
from mjnav.report.run_page.pose_likelihood import SIDE, pack_likelihood
from mjnav.report.run_page.run_frames import RunFrames
from mjnav.report.scans import BelievedWay
from mjnav.report.scene_outline import body_outline
from mjnav.scenarios.spec import Scenario

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

"""How likely a scan is at positions around the believed one, by the localizer's likelihood field."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from mjnav.estimation.lidar.cloud import TEMPER
from mjnav.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.messages import Array
from mjnav.report.run_page.packed import Packer
from mjnav.report.scans import BelievedWay, ShownScan, range_noise, scan_points
from mjnav.scenarios.floor import floor_of_lidar
from mjnav.scenarios.spec import Scenario

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

"""The messages of a log as rows of numbers: one frame a tick, or every n-th of a long run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.parameters import Parameters
from mjnav.errors import DamagedLogError, InputError
from mjnav.geometry.distances import ellipse_95
from mjnav.log.encode.candidates import NUM_LEVELS, level_bounds
from mjnav.log.encode.particles import decode_particles
from mjnav.log.encode.plan import MOST_PEOPLE, MOST_SAMPLES, SUFFIX, decode_plan
from mjnav.log.read.log import Log
from mjnav.log.read.records import EXPORT, FREE_EXPORT, Budget
from mjnav.log.read.ticks import NOT_OURS
from mjnav.log.read.trajectory import track_number
from mjnav.messages import PHASES, Array, PlanShown
from mjnav.report.lidar_view import ShownScan, goes_by_scans

ROBOT_PARTICLES = 40  # kept of a belief
TRACK_PARTICLES = 16
ALL_TRACK_PARTICLES = 96  # kept of all tracks together, but for two of each
MAX_EVENTS = 500
MAX_FREE = 96  # arcs kept of candidates that are no grid
POINTS = 5  # kept of a way, evenly over its time; the first is where the sample is now
LEVELS = ("unknown", "debug", "info", "warning", "error", "fatal")  # foxglove.Log's

Ways = Mapping[str, Array]  # track -> (MOST_SAMPLES, POINTS, 2) [m]


@dataclass(frozen=True, slots=True)
class CandidateRanks:
    """One tick's. `level` goes from 0, the cheapest eighth, to 7."""

    window: Array  # (4,) lowest and highest v [m/s], lowest and highest omega [rad/s]
    level: NDArray[np.uint8]  # (num_v * num_omega,) of a grid, omega fastest; else (n,)
    free: NDArray[np.uint8] | None = None  # (n, 2) shares of the window in 255ths; None for a grid


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


class RunFrames:
    """What a page shows of a run. Arrays (T, ...) have NaN where a tick lacks something; dicts are by frame.

    `ticks` are the frames' numbers. Raises InputError where a message is not as mjnav writes it, DamagedLogError where
    what is named in a few ticks would take too much memory in all.
    """

    def __init__(self, log: Log, ticks: Sequence[int]):
        self._frame = {tick: i for i, tick in enumerate(ticks)}
        self._arrays: dict[str, Array] = {}
        self._tracks_of: dict[int, Mapping[str, Array]] = {}
        self._places: dict[str, str] = {}  # the columns of the tracks of the latest tick
        self.scans: dict[int, ShownScan] = {}
        self.detections: dict[int, Array] = {}  # (n, 6)
        self.statuses: dict[int, str] = {}
        self.cones: dict[int, tuple[Array, Array]] = {}
        self.cone_obstacles: dict[int, str] = {}
        self.candidates: dict[int, CandidateRanks] = {}
        self.plans: dict[int, PlanShown] = {}
        self.ways: dict[int, Ways] = {}
        self.own_ways: dict[int, tuple[Array, Array]] = {}  # (n, 2) of the robot, and (k, 3) discs that it has drawn
        self.events: list[dict[str, Any]] = []  # the first MAX_EVENTS messages of /events
        self.num_events = 0
        self._path, self._budget = log.path, Budget(log.path.stat().st_size)
        scenario = log.scenario()
        parameters, defaults = scenario.control.parameters, Parameters()
        # Of candidates that are one: (num_v, num_omega).
        self.grid: tuple[Any, Any] = (
            parameters.get("num_v", defaults.num_v),
            parameters.get("num_omega", defaults.num_omega),
        )
        self._scenario = scenario
        self.by_scans = goes_by_scans(scenario)
        self._read(log, predicts=scenario.prediction is not None)

    def __len__(self) -> int:
        """The number of frames."""
        return len(self._frame)

    def array(self, name: str, *shape: int) -> Array:
        """The rows of one name, (T, *shape); all NaN where no message had it."""
        return self._arrays.get(name, np.full((len(self), *shape), np.nan))

    def names(self, kind: str) -> list[str]:
        """The people ("person") or tracks ("track") that any frame has, in order."""
        prefix = f"{kind} "
        found = [name.removeprefix(prefix) for name in self._arrays if name.startswith(prefix)]
        return sorted(found, key=lambda name: (len(name), name))

    def _read(self, log: Log, *, predicts: bool) -> None:
        handlers: Mapping[str, Callable[[int, Any], None]] = {
            "/robot/state": self._robot,
            "/people/truth": self._people,
            "/people/estimate": self._tracks,
            "/belief/robot": self._robot_particles,
            "/belief/obstacles": self._track_particles,
            "/command": self._command,
            "/decision": self._decision,
            "/cone": self._cone,
            "/candidates": self._candidates,
            "/plan": self._plan,
            "/way": self._way,
            "/tick": self._timing,
            **({"/scene": self._scene} if predicts else {}),  # much to read for nothing else
            **({"/scan": self._scan, "/detections": self._detections} if self.by_scans else {}),
        }
        for message in log.messages(*handlers, "/events"):
            frame = self._frame.get(message.sequence)
            try:
                if message.topic == "/events":
                    self._event(1e-9 * message.time_ns, message.value)
                elif frame is not None:
                    handlers[message.topic](frame, message.value)
            except NOT_OURS as error:
                text = f"{message.topic} of tick {message.sequence} is not what mjnav writes"
                raise InputError(f"{log.path}: {text}: {type(error).__name__} {error}") from error

    def _put(self, name: str, frame: int, values: Any) -> None:
        row = np.asarray(values, float)
        if name not in self._arrays:
            if not self._budget.allows_export(len(self) * row.nbytes):  # a name in one tick is a column of all
                what = f"{FREE_EXPORT} bytes and {EXPORT} for each of the log's"
                raise DamagedLogError(f"{self._path}: damaged: the columns of its page would take more than {what}")
            self._arrays[name] = np.full((len(self), *row.shape), np.nan)
        self._arrays[name][frame] = row

    def _robot(self, frame: int, value: Mapping[str, Any]) -> None:
        self._put("time", frame, value["time"])
        self._put("pose", frame, value["pose"])
        self._put("twist", frame, value["twist"])
        if (estimate := value["estimate"]) is not None:
            self._put("estimate", frame, estimate["mean"])
            self._put("ellipse", frame, ellipse_95(estimate["covariance"]))

    def _people(self, frame: int, value: Mapping[str, Any]) -> None:
        for person in value["people"]:
            self._put(f"person {person['name']}", frame, person["position"])

    def _tracks(self, frame: int, value: Mapping[str, Any]) -> None:
        tracks = value["people"]
        self._places = columns_of_tracks([track["name"] for track in tracks], self._places)
        for track in tracks:
            place = self._places[track["name"]]
            self._put(f"track {place}", frame, [*track["position"], *ellipse_95(track["covariance"])])
            if (number := track_number(track["name"])) is not None:
                life = [number, track.get("age", 0.0), track.get("unseen", 0.0), track["radius"]]
                self._put(f"life {place}", frame, life)
        if tracks:
            self._put("people ess", frame, min(track["ess"] for track in tracks))
        self._tracks_of[frame] = {self._places[track["name"]]: np.array(track["position"]) for track in tracks}

    def _robot_particles(self, frame: int, cloud: Any) -> None:
        x, y, _, weight = decode_particles(cloud).values()
        drawn = _drawn(weight, ROBOT_PARTICLES)
        centre = self.array("estimate", 3)[frame, :2]
        self._put("robot particles", frame, np.stack([x, y], axis=-1)[drawn] - centre)

    def _track_particles(self, frame: int, cloud: Any) -> None:
        x, y, _, _, weight, place = decode_particles(cloud).values()
        tracks = self._tracks_of[frame]
        number = min(TRACK_PARTICLES, max(2, ALL_TRACK_PARTICLES // max(1, len(tracks))))
        for i, (name, centre) in enumerate(tracks.items()):
            own = np.flatnonzero(place == i)
            drawn = own[_drawn(weight[own], number)] if own.size else own
            offsets = np.full((TRACK_PARTICLES, 2), np.nan)
            offsets[: drawn.size] = np.stack([x[drawn], y[drawn]], axis=-1) - centre
            self._put(f"particles {name}", frame, offsets)

    def _command(self, frame: int, value: Mapping[str, Any]) -> None:
        self._put("command", frame, [value["v"], value["omega"]])

    def _decision(self, frame: int, value: Mapping[str, Any]) -> None:
        self.statuses[frame] = str(value["status"])
        self._put("decision", frame, [value["v"], value["omega"]])
        if (nominal := value["nominal"]) is not None:
            self._put("nominal", frame, [nominal["v"], nominal["omega"]])
        if (cost := value["cost"]) is not None:
            parts = [cost["goal"], _sum(cost["cone"]), _sum(cost["lane"]), cost["total"]]
            self._put("cost", frame, [np.nan if part is None else part for part in parts])

    def _cone(self, frame: int, value: Any) -> None:
        self.cones[frame] = np.array(value.samples), np.array(value.desired)
        self.cone_obstacles[frame] = value.obstacle
        self._put("safe share", frame, value.safe_share)

    def _candidates(self, frame: int, value: Any) -> None:
        ranks = candidate_ranks(np.array(value.v), np.array(value.omega), np.array(value.total), self.grid)
        if ranks is not None:
            self.candidates[frame] = ranks

    def _plan(self, frame: int, value: Any) -> None:
        self.plans[frame] = decode_plan(value)

    def _way(self, frame: int, value: Mapping[str, Any]) -> None:
        self.own_ways[frame] = np.array(value["line"]).reshape(-1, 2), np.array(value["drawn"]).reshape(-1, 3)

    def _scene(self, frame: int, value: Any) -> None:
        if ways := predicted_ways(value):
            self.ways[frame] = {self._places.get(name, name): way for name, way in ways.items()}

    def _scan(self, frame: int, value: Any) -> None:
        self.scans[frame] = ShownScan.of(value, self._scenario)

    def _detections(self, frame: int, value: Mapping[str, Any]) -> None:
        rows = [[*one["position"], one["radius"], *ellipse_95(one["covariance"])] for one in value["detections"]]
        self.detections[frame] = np.array(rows, float).reshape(-1, 6)

    def _timing(self, frame: int, value: Mapping[str, Any]) -> None:
        self._put("phases", frame, [1e-6 * value[f"{phase}_ns"] for phase in PHASES])
        self._put("lateness", frame, 1e-6 * value["lateness_ns"])

    def _event(self, time: float, value: Any) -> None:
        self.num_events += 1
        if len(self.events) < MAX_EVENTS:
            level = LEVELS[value.level] if value.level < len(LEVELS) else LEVELS[0]
            self.events.append({"time": time, "level": level, "name": value.name, "text": value.message})


def columns_of_tracks(names: Sequence[str], before: Mapping[str, str]) -> dict[str, str]:
    """The column of each track's figures by its name, given those of the tick before.

    A person's track has one of its own; one that came about by a scan takes the first that is free until it ends.
    """
    kept = {name: before[name] for name in names if name in before}
    taken, column = {*kept.values()}, 0
    for name in names:
        if name in kept:
            continue
        if track_number(name) is None:
            kept[name] = name
            continue
        while f"column{column}" in taken:
            column += 1
        kept[name] = f"column{column}"
        taken.add(kept[name])
    return kept


def _sum(parts: list[float | None]) -> float | None:
    return None if None in parts else float(sum(part or 0.0 for part in parts))


def _drawn(weights: Array, number: int) -> np.ndarray:
    """Indices of `number` particles, evenly over their weights."""
    total = np.cumsum(weights)
    return np.searchsorted(total, total[-1] * (np.arange(number) + 0.5) / number).clip(0, len(weights) - 1)

"""A log as what a page plays back."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InputError
from mjnav.log.encode.candidates import NUM_LEVELS, PREVIEW
from mjnav.log.read.log import Log
from mjnav.messages import PHASES, Array
from mjnav.metrics.safety import clearance
from mjnav.report.inspection import shown_people
from mjnav.report.run_page import layers
from mjnav.report.run_page.run_frames import TRACK_PARTICLES, RunFrames
from mjnav.scene.bodies import KnownBodies
from mjnav.scene.spec import Scenario, Table
from mjnav.scene.ways import planned_legs
from mjnav.settings import keys, tables

MAX_FRAMES = 1200  # two minutes at 10 Hz
PARTICLE = 4e-3  # [m] step of a particle's offset: half a metre at most
MAX_DRAWINGS = 12  # of what the robot has drawn of the floor


Playback = dict[str, Any]  # what a page's scripts get of a run, as JSON (web/unpack.js)


@np.errstate(all="ignore")  # what a damaged log says may be any number
def playback(log: Log, *, keep: Iterable[int] = (), max_frames: int = MAX_FRAMES) -> Playback:
    """What a page plays back of a log.

    A run of more than `max_frames` ticks is thinned, but for the ticks in `keep`.

    Raises InputError where the log holds no run, no whole tick of it, or messages that are not as mjnav writes them.
    """
    run, _ = log.whole_ticks()
    scenario = log.scenario()
    if run is None:
        raise InputError(f"{log.path}: holds no whole tick of a run")
    stride = max(1, -(-len(run.ticks) // max_frames))
    wanted = np.flatnonzero(np.isin(run.ticks, list(keep))).tolist()
    last = len(run.ticks) - 1  # of a run that ended its final state, which shows the beliefs of the tick before
    kept = np.unique([*range(0, last, stride), *wanted, max(last - 1, 0), last])
    frames = RunFrames(log, run.ticks[kept].tolist())
    people, tracks = frames.names("person"), frames.names("track")
    packer = layers.Packer()
    _pack_states(packer, frames, people, tracks)
    layers.pack_consistency(packer, run.trajectory, scenario, kept, frames.array("people ess"))
    known = len(scenario.people) == run.trajectory.people_position.shape[1]
    bodies = _pack_clearance(packer, clearance(run.trajectory, scenario) if known else {}, kept)
    plan = layers.pack_plans(packer, frames.plans, len(frames))
    return {
        "scene": {**_scene_outline(scenario), "own_ways": _own_ways(frames)},
        "people": people,
        "tracks": tracks,
        "lidar": _pack_lidar(packer, frames, scenario, tracks),  # of a robot that goes by its scans, or None
        "phases": PHASES,
        "preview": PREVIEW,
        "levels": NUM_LEVELS,
        "normalised": bool(scenario.control.parameters.get("normalise", scenario.control.method != "rkhs-paper")),
        "particles": {
            "robot": scenario.estimation.robot.particles,
            "tracks": scenario.estimation.obstacles.particles,
        },
        "period": scenario.control.period,
        "statuses": _pack_status(packer, frames),
        "cone": None if plan and plan["violation"] else _pack_cones(packer, frames),
        "candidates": _pack_candidates(packer, frames),
        "bodies": bodies,
        "ticks": len(run.ticks) - 1,
        "stride": stride,
        "events": frames.events,  # the first MAX_EVENTS
        "num_events": frames.num_events,
        "parameters": _set_parameters(scenario),
        "noise": scenario.noise.profile,
        "plan": plan,  # of a method that plans ahead, or None
        **packer.packed(),
    }


def _stacked(parts: list[Array], length: int, *shape: int) -> Array:
    """(T, n, *shape) of n arrays (T, *shape), also where n = 0."""
    return np.stack(parts, axis=1) if parts else np.empty((length, 0, *shape))


def _pack_states(packer: layers.Packer, frames: RunFrames, people: list[str], tracks: list[str]) -> None:
    size = len(frames)
    packer.numbers("time", frames.array("time"))
    for name in ("pose", "estimate"):
        packer.measured(name, _unwrapped(frames.array(name, 3)), layers.STEP)
    packer.measured("ellipse", frames.array("ellipse", 3), layers.STEP)
    for name in ("twist", "command", "decision", "nominal"):
        packer.measured(name, frames.array(name, 2), layers.STEP)
    packer.numbers("cost", frames.array("cost", 4).astype(np.float32))
    packer.measured("phases", frames.array("phases", len(PHASES)), layers.STEP)
    packer.measured("lateness", frames.array("lateness"), layers.STEP)
    packer.measured("people", _stacked([frames.array(f"person {name}", 2) for name in people], size, 2), layers.STEP)
    believed = _stacked([frames.array(f"track {name}", 5) for name in tracks], size, 5)
    packer.measured("tracks", believed, layers.STEP)
    layers.pack_ways(packer, frames.ways, tracks, believed[..., :2])
    packer.offsets("robot_particles", frames.array("robot particles", 0, 2), PARTICLE)
    particles = [frames.array(f"particles {name}", TRACK_PARTICLES, 2) for name in tracks]
    packer.offsets("track_particles", _stacked(particles, size, TRACK_PARTICLES, 2), PARTICLE)


def _unwrapped(pose: Array) -> Array:
    """Poses (T, 3) whose headings go on beyond pi, so that they change little from row to row."""
    known = np.isfinite(pose[:, 2])
    pose = pose.copy()
    pose[known, 2] = np.unwrap(pose[known, 2])
    return pose


def _pack_clearance(packer: layers.Packer, distances: Mapping[str, Array], kept: NDArray[np.int64]) -> list[str]:
    """The least clearance from each frame on until the next, and the number of the body in the names returned."""
    names = list(distances)
    least, nearest = np.full(len(kept), np.nan), np.full(len(kept), layers.NONE, np.uint8)
    if names:
        steps = np.stack(list(distances.values()))  # (bodies, T)
        steps = np.where(np.isnan(steps), np.inf, steps)  # of who is not there
        by_frame = np.minimum.reduceat(steps, np.minimum(kept, steps.shape[1] - 1), axis=1)
        least = by_frame.min(axis=0)
        nearest = np.where(np.isfinite(least), np.minimum(by_frame.argmin(axis=0), layers.NONE), layers.NONE).astype(
            np.uint8
        )
        least[~np.isfinite(least)] = np.nan
    packer.measured("clearance", least, layers.STEP)
    packer.numbers("nearest", nearest)
    return names


def _pack_status(packer: layers.Packer, frames: RunFrames) -> list[str]:
    """The names that the codes stand for; the last frame of a run that ended has none.

    Nor has one whose status is beyond those that a byte can number.
    """
    names = sorted(set(frames.statuses.values()))
    codes = np.full(len(frames), layers.NONE, np.uint8)
    for frame, status in frames.statuses.items():
        codes[frame] = min(names.index(status), layers.NONE)
    packer.numbers("status", codes)
    return names


def _pack_cones(packer: layers.Packer, frames: RunFrames) -> dict[str, Any] | None:
    bins = layers.cone_bins(frames.cones, len(frames))
    if bins is None:
        return None
    low, width, shares = bins
    names = sorted(set(frames.cone_obstacles.values()))
    codes = np.full(len(frames), layers.NONE, np.uint8)
    for frame, name in frames.cone_obstacles.items():
        codes[frame] = min(names.index(name), layers.NONE)
    packer.numbers("cone_obstacle", codes)
    packer.numbers("cone", shares)
    packer.measured("safe_share", frames.array("safe share"), layers.STEP)
    return {"low": low, "width": width, "bins": shares.shape[2], "obstacles": names}


def _pack_candidates(packer: layers.Packer, frames: RunFrames) -> dict[str, Any] | None:
    """The grid's shape, or None in its place where candidates lie freely; nothing where there are none at all.

    A tick that is not as most are is left out.
    """
    if not frames.candidates:
        return None
    free = 2 * sum(ranks.free is not None for ranks in frames.candidates.values()) > len(frames.candidates)
    shown = {frame: ranks for frame, ranks in frames.candidates.items() if (ranks.free is not None) == free}
    number = max(ranks.level.size for ranks in shown.values())
    window = np.full((len(frames), 4), np.nan)
    level = np.full((len(frames), number), layers.NONE, np.uint8)
    places = np.zeros((len(frames), number if free else 0, 2), np.uint8)
    for frame, ranks in shown.items():
        window[frame] = ranks.window
        level[frame, : ranks.level.size] = ranks.level
        if ranks.free is not None:
            places[frame, : len(ranks.free)] = ranks.free
    packer.measured("window", window, layers.STEP)
    packer.numbers("level", level)
    packer.numbers("places", places)
    return {"grid": None if free else list(frames.grid)}


def _pack_lidar(
    packer: layers.Packer, frames: RunFrames, scenario: Scenario, tracks: list[str]
) -> dict[str, Any] | None:
    """With the map that the robot has, where that is not the world's own."""
    if not frames.by_scans:
        return None
    known = None if scenario.estimation.map is None else _bodies(scenario.known_bodies)
    return {**layers.pack_lidar(packer, frames, scenario, tracks), "map": known}


# ----------------------------------------------------------------------------- the scene and its keys


def _scene_outline(scenario: Scenario) -> dict[str, Any]:
    """Walls as {from, to, thickness}, tables as {corners, legs, leg_radius}, pillars, lanes, ways and radii."""
    robot = scenario.robot
    legs = planned_legs(scenario)
    return {
        "start": list(robot.start),
        "route": [list(point) for point in robot.route],
        "goal_tolerance": robot.goal_tolerance,
        "radius": robot.limits.half_width,
        "discs": [list(disc) for disc in robot.limits.discs],
        "people_radius": [person.radius for person in scenario.people],
        "people_legs": [{"person": leg.person, "points": [leg.start, *leg.points]} for leg in legs if leg.points],
        "people_words": [person.words for person in shown_people(scenario)],
        **_bodies(scenario),
        "lanes": [scenario.lanes.left, scenario.lanes.right] if scenario.lanes else [],
    }


def _own_ways(frames: RunFrames) -> list[dict[str, Any]]:
    """The robot's planned ways, each from a frame on, and the discs that it had drawn by then; to the centimetre.

    What was drawn stands with MAX_DRAWINGS of the ways, evenly over them, and with the last.
    """
    every = -(-len(frames.own_ways) // MAX_DRAWINGS)
    ways = sorted(frames.own_ways.items())
    return [
        {"frame": frame, "line": np.round(line, 2).tolist()}
        | ({"drawn": np.round(drawn, 2).tolist()} if i % every == 0 or i == len(ways) - 1 else {})
        for i, (frame, (line, drawn)) in enumerate(ways)
    ]


def _bodies(bodies: Scenario | KnownBodies) -> dict[str, Any]:
    """Walls, tables and pillars alone: of the world, or of the map that the robot has."""
    return {
        "walls": [{"from": w.start, "to": w.end, "thickness": w.thickness} for w in bodies.walls],
        "tables": [
            {"corners": _top(t).tolist(), "legs": t.legs.tolist(), "leg_radius": t.leg_radius} for t in bodies.tables
        ],
        "pillars": [{"position": p.position, "radius": p.radius} for p in bodies.pillars],
    }


def _top(table: Table) -> Array:
    """Corners of a table's top, (4, 2)."""
    half = 0.5 * np.array(table.size) + table.leg_radius
    cosine, sine = np.cos(table.yaw), np.sin(table.yaw)
    corners = half * [[1, 1], [-1, 1], [-1, -1], [1, -1]]
    return np.array(table.position) + corners @ [[cosine, sine], [-sine, cosine]]


# What the map shows, or the page in another place.
_ELSEWHERE = ("schema", "name", "description", "seed", "walls", "tables", "pillars", "people", "lanes")
_ELSEWHERE_TOO = ("robot.start", "robot.goal", "robot.waypoints", "control.method")


def _set_parameters(scenario: Scenario) -> dict[str, str]:
    """The keys of the run file whose values are not their defaults, with the values as text; geometry is left out."""
    return {
        key: json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else value
        for key, value in _changed(scenario, "")
        if key not in (*_ELSEWHERE, *_ELSEWHERE_TOO)
    }


def _changed(value: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, field in keys(type(value)).items():
        item = getattr(value, field.name)
        key = f"{prefix}{name}"
        if key in _ELSEWHERE or (not field.beside and item == field.default):
            continue
        if is_dataclass(item):
            yield from _changed(item, f"{key}.")
        elif field.beside and isinstance(item, Mapping):
            yield from ((f"{prefix}{own}", tables(one)) for own, one in item.items())
        else:
            yield key, field.type.write(item)

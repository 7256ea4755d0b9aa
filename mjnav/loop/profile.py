"""Where a run's microseconds go: the parts named here are timed while a profile lasts, and untouched otherwise.

A part's time is its own: without the parts that it calls, and with the 1 us or so that timing each of those costs. What
a phase takes beside its parts is the loop's own.
"""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, wraps
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.loop.pacer import FreePacer
from mjnav.messages import PHASES, Array

# "module:name" or "module:Class.name" -> the part that its calls count as
TARGETS = MappingProxyType(
    {
        "mjnav.world.simulator:Simulator.state": "truth",
        "mjnav.world.simulator:Simulator.advance": "clock of steps",
        "mjnav.world.sensors:Sensors.read": "sensors",
        "mjnav.world.mujoco_engine:MujocoEngine.scan": "lidar",
        "mjnav.world.kinematic_engine:KinematicEngine.scan": "lidar",
        "mjnav.world.mujoco_engine:MujocoEngine.advance": "physics",
        "mjnav.world.kinematic_engine:KinematicEngine.advance": "physics",
        "mjnav.world.pedestrians:Pedestrians.velocities": "pedestrians",
        "mjnav.world.actuation:Actuation.twists": "actuation",
        "mjnav.estimation.localizer:ParticleLocalizer.update": "robot",
        "mjnav.estimation.kalman:KalmanLocalizer.update": "robot",
        "mjnav.estimation.direct:DirectLocalizer.update": "robot",
        "mjnav.estimation.tracker:ParticleTracker.update": "people",
        "mjnav.estimation.kalman:KalmanTracker.update": "people",
        "mjnav.estimation.direct:DirectTracker.update": "people",
        "mjnav.loop.onboard.navigator:Navigator.observe": "observe",
        "mjnav.loop.onboard.navigator:Navigator.decide": "choose",
        "mjnav.control.problem.problem:Problem.candidates": "candidates",
        "mjnav.control.problem.problem:Problem.reach": "reach",
        "mjnav.control.problem.problem:Problem.goal_cost": "goal cost",
        "mjnav.control.problem.problem:Problem.violation": "constraints at the mean",
        "mjnav.control.problem.problem:Problem.cone": "constraints on samples",
        "mjnav.control.problem.problem:Problem.lanes": "constraints on samples",
        "mjnav.control.problem.sample_cone:SampleCone.raw_moments": "constraints on samples",
        "mjnav.control.problem.sample_cone:SampleCone.samples": "constraints on samples",
        "mjnav.control.problem.sample_cone:SampleCone.reduce": "constraints on samples",
        "mjnav.loop.episode:Episode._cone": "cone for the log",
        "mjnav.recording.read.trajectory:TrajectoryBuilder.add": "trajectory",
        "mjnav.recording.encode.json_messages:encode_robot": "encode documents",
        "mjnav.recording.encode.json_messages:encode_odometry": "encode documents",
        "mjnav.recording.encode.json_messages:encode_command": "encode documents",
        "mjnav.recording.encode.json_messages:encode_decision": "encode documents",
        "mjnav.recording.encode.json_messages:encode_people_truth": "encode documents",
        "mjnav.recording.encode.json_messages:encode_people_estimate": "encode documents",
        "mjnav.recording.encode.json_messages:encode_contacts": "encode documents",
        "mjnav.recording.write.writer:encode_timing": "encode documents",
        "mjnav.recording.encode.geometry:encode_transforms": "encode poses and scan",
        "mjnav.recording.encode.geometry:encode_pose": "encode poses and scan",
        "mjnav.recording.encode.geometry:encode_scan": "encode poses and scan",
        "mjnav.recording.encode.geometry:encode_robot_particles": "encode particles",
        "mjnav.recording.encode.geometry:encode_track_particles": "encode particles",
        "mjnav.recording.encode.scene:SceneEncoder.encode": "encode scene",
        "mjnav.recording.encode.topics:encode_candidates": "encode candidates",
        "mjnav.recording.encode.topics:encode_cone": "encode cone",
        "mjnav.recording.write.sink:DirectSink.put": "write",
        "mjnav.recording.write.sink:ThreadSink.put": "hand over",
        "mjnav.loop.pacer:RealTimePacer.wait": "wait",
    }
)
OWN = "the loop's own"
BETWEEN = "between"  # the last phase's end and the next tick's start
_START, _LAP = "mjnav.loop.pacer:Stopwatch.start", "mjnav.loop.pacer:Stopwatch.lap"


class Profile:
    """Time [ns] and calls of every part of every tick, by phase; filled while `profiled` lasts."""

    def __init__(self, clock: Callable[[], int]):
        self._clock = clock
        self._thread = threading.get_ident()
        self._inner = 0  # [ns] that parts took within the part that is running
        self._tick: dict[tuple[str, str], list[int]] = {}  # (phase, part) -> ns, calls of the running tick
        self._phase = 0
        self._since: int | None = None  # when the running phase began; None before the first
        self._ticks: list[dict[tuple[str, str], list[int]]] = []

    def timed(self, function: Callable[..., Any], part: str) -> Callable[..., Any]:
        """The function, with its time counted as the part's."""

        @wraps(function)
        def timed(*args, **kwargs):
            if threading.get_ident() != self._thread:  # the log's own thread is in no tick's way
                return function(*args, **kwargs)
            before, self._inner = self._inner, 0
            began = self._clock()
            try:
                return function(*args, **kwargs)
            finally:
                taken = self._clock() - began
                self._add(part, taken - self._inner)
                self._inner = before + taken

        return timed

    def starting(self, start: Callable[..., None]) -> Callable[..., None]:
        """The stopwatch's start, which ends the tick before."""

        @wraps(start)
        def starting(*args):
            start(*args)
            if self._since is None:
                self._since, self._inner = self._clock(), 0
            else:
                self._close(BETWEEN)
                self._ticks.append(self._tick)
            self._tick, self._phase = {}, 0

        return starting

    def lapping(self, lap: Callable[..., None]) -> Callable[..., None]:
        """The stopwatch's lap, which ends the phase."""

        @wraps(lap)
        def lapping(*args):
            lap(*args)
            self._close(PHASES[self._phase])
            self._phase += 1

        return lapping

    def _add(self, part: str, own: int) -> None:
        phase = PHASES[self._phase] if self._phase < len(PHASES) else BETWEEN
        cell = self._tick.setdefault((phase, part), [0, 0])
        cell[0] += own
        cell[1] += 1

    def _close(self, phase: str) -> None:
        """What the phase took beside its parts, which have been counted."""
        now = self._clock()
        assert self._since is not None
        self._tick[phase, OWN] = [now - self._since - self._inner, 0]
        self._since, self._inner = now, 0

    def summary(self) -> dict[str, Any]:
        """Microseconds a tick of each phase and of its parts, their share of the whole tick, and calls a tick.

        {"ticks", "tick_us", "phases": {phase: {"p50", "p99", "mean", "share", "parts": {part: {.., "calls"}}}}}; parts
        are in order of their means, and a phase's means add up to its own.
        """
        keys = dict.fromkeys(key for tick in self._ticks for key in tick)
        cells = {key: np.array([tick.get(key, (0, 0)) for tick in self._ticks], float) for key in keys}
        whole = sum((cell[:, 0] for cell in cells.values()), np.zeros(len(self._ticks)))
        phases = {}
        for phase in (*PHASES, BETWEEN):
            parts = {part: cell for (of, part), cell in cells.items() if of == phase}
            if not parts:
                continue
            total = np.sum([cell[:, 0] for cell in parts.values()], axis=0)
            rows = {
                part: {**_figures(cell[:, 0], whole), "calls": float(cell[:, 1].mean())} for part, cell in parts.items()
            }
            rows = dict(sorted(rows.items(), key=lambda row: -row[1]["mean"]))
            phases[phase] = {**_figures(total, whole), "parts": rows}
        tick = {name: figure for name, figure in _figures(whole, whole).items() if name != "share"} if phases else None
        return {"ticks": len(self._ticks), "tick_us": tick, "phases": phases}


def _figures(duration: Array, whole: Array) -> dict[str, float]:
    """[us] p50, p99 and mean of a duration [ns] in every tick, and its share of the ticks' time."""
    p50, p99 = (1e-3 * np.quantile(duration, (0.5, 0.99))).tolist()
    share = float(duration.sum() / whole.sum()) if whole.any() else 0.0
    return {"p50": p50, "p99": p99, "mean": 1e-3 * float(duration.mean()), "share": share}


@contextmanager
def profiled(clock: Callable[[], int] | None = None) -> Iterator[Profile]:
    """Times the parts of an episode that is made and run within; everything is as before afterwards.

    A part counts if its module is loaded: warm up first. One thread, one profile at a time.
    """
    profile = Profile(clock or FreePacer().now)
    wrappers = {target: lambda function, part=part: profile.timed(function, part) for target, part in TARGETS.items()}
    wrappers |= {_START: profile.starting, _LAP: profile.lapping}
    replaced: list[tuple[Any, str, Any]] = []
    try:
        for target, wrapper in wrappers.items():
            module, _, path = target.partition(":")
            if module not in sys.modules:
                continue
            *owners, name = path.split(".")
            owner = sys.modules[module]
            for inner in owners:
                owner = getattr(owner, inner)
            original = vars(owner)[name]
            replaced.append((owner, name, original))
            setattr(owner, name, _replacement(original, name, wrapper))
        yield profile
    finally:
        for owner, name, original in reversed(replaced):
            setattr(owner, name, original)


def _replacement(original: Any, name: str, wrapper: Callable[[Callable[..., Any]], Callable[..., Any]]) -> Any:
    """The function in its wrapper, or the same kind of descriptor around it."""
    if isinstance(original, cached_property):
        replacement = cached_property(wrapper(original.func))
        replacement.__set_name__(None, name)  # pyright: ignore[reportArgumentType]
        return replacement
    if isinstance(original, classmethod | staticmethod):
        return type(original)(wrapper(original.__func__))
    return wrapper(original)


def describe(summary: dict[str, Any]) -> str:
    """The summary as a table for people."""
    header = f"{'us a tick':34s}{'p50':>9s}{'p99':>9s}{'mean':>9s}{'share':>8s}{'calls':>8s}"
    lines = [header]
    for phase, figures in summary["phases"].items():
        lines.append(_row(phase, figures))
        lines += [_row(f"  {part}", row) for part, row in figures["parts"].items()]
    if summary["tick_us"] is not None:
        lines.append(_row("tick", {**summary["tick_us"], "share": 1.0}))
    return "\n".join(lines)


def _row(name: str, figures: dict[str, Any]) -> str:
    calls = f"{figures['calls']:8.1f}" if figures.get("calls") else ""
    p50, p99, mean, share = (figures[key] for key in ("p50", "p99", "mean", "share"))
    return f"{name:34s}{p50:9.1f}{p99:9.1f}{mean:9.1f}{100.0 * share:7.1f}%{calls}"

"""The worst moments of a run: when to look, and at what."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import groupby
from math import inf, isfinite

import numpy as np

from mjnav.log.read.ticks import LoggedRun
from mjnav.messages import PHASES, Array
from mjnav.metrics import consistency, progress, safety
from mjnav.metrics.ending import INFEASIBLE
from mjnav.scene.spec import Scenario

NUM_MOMENTS = 5
CLEARANCE = "clearance"  # the kind

# Of each kind, what is as bad as one of any other.
CLOSE = 0.1  # [m] from a surface; half of it counts twice
LOST = 0.1  # [m] that the robot is from where it believes to be
MISJUDGED = 0.4  # [m] that a person is from where the robot believes
ASTRAY = 1.5  # [m] from the way
STUCK = 1.0  # [s] in which nothing met the constraints
SILENT = 0.5  # [s] of which the log tells nothing
DEPLETED = 0.05  # of the particles count; half of it counts twice


@dataclass(frozen=True, slots=True)
class WorstMoment:
    """One kind's worst."""

    kind: str
    time_s: float  # simulated
    tick: int
    value: float
    unit: str
    text: str
    severity: float  # 1 is as bad as in any other kind


def worst_moments(run: LoggedRun, scenario: Scenario) -> list[WorstMoment]:
    """At most NUM_MOMENTS, at most one of each kind, the most severe first; none whose time is not known.

    The least clearance is always among them: it is what a reader of a run that went well asks for.
    """
    found = [moment for kind in _KINDS if (moment := kind(run, scenario)) is not None]
    found = [moment for moment in found if isfinite(moment.time_s)]
    kept = sorted(found, key=lambda moment: (moment.kind != CLEARANCE, -moment.severity))[:NUM_MOMENTS]
    return sorted(kept, key=lambda moment: -moment.severity)


def _at(run: LoggedRun, row: int, kind: str, value: float, unit: str, text: str, severity: float) -> WorstMoment:
    time, tick = float(run.trajectory.time[row]), int(run.ticks[row])
    return WorstMoment(kind, time, tick, float(value), unit, text, float(severity))


def _worst(values: Array) -> tuple[int, ...] | None:
    """Where the largest of the finite values stands; None without finite values."""
    finite = np.isfinite(values)
    if not finite.any():
        return None
    return tuple(int(i) for i in np.unravel_index(np.where(finite, values, -inf).argmax(), values.shape))


def _largest(run: LoggedRun, kind: str, metres: Array, text: str, bad: float) -> WorstMoment | None:
    """The tick with the largest of distances (T,) or (T, P); `bad` is as severe as 1. `text` may name the person."""
    if (place := _worst(metres)) is None:
        return None
    value = metres[place]
    return _at(run, place[0], kind, value, "m", text.format(value=value, person=place[-1]), value / bad)


def _contact(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    """The hardest contact; before any other kind."""
    contacts = run.trajectory.contacts
    if not contacts:
        return None
    hardest = max(contacts, key=lambda contact: contact.force)
    row = int(np.searchsorted(run.trajectory.time[1:], hardest.time))
    force = f" with {hardest.force:.0f} N" if hardest.force > 0.0 else ""
    hit = next((touch for touch in safety.touches(run.trajectory, scenario) if touch.time == hardest.time), None)
    whose = f"; {hit}" if hit is not None else ""
    moment = _at(run, row, "contact", hardest.force, "N", f"the robot touches {hardest.name}{force}{whose}", inf)
    return replace(moment, time_s=hardest.time)


def _clearance(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    """The step that comes closest to anything, unless contacts speak for themselves."""
    by_name = safety.clearance(run.trajectory, scenario)
    if not by_name or run.trajectory.contacts or (place := _worst(-np.array(list(by_name.values())))) is None:
        return None
    body, row = place
    name = list(by_name)[body]
    value = by_name[name][row]
    return _at(run, row, CLEARANCE, value, "m", f"{value:.2f} m from {name}", CLOSE / max(value, 1e-3))


def _lateness(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    return _timing(run, scenario, "lateness", run.timing[:, -1], "began {value:.2f} ms behind its deadline")


def _longest_tick(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    phases = run.timing[:, 1 : 1 + len(PHASES)]
    if not phases.size:
        return None
    worst = phases[phases.sum(1).argmax()]
    most = f"{PHASES[int(worst.argmax())]} {1e-6 * worst.max():.2f} ms"
    return _timing(run, scenario, "tick", phases.sum(1), "took {value:.2f} ms, most of all " + most)


def _timing(run: LoggedRun, scenario: Scenario, kind: str, ns: np.ndarray, text: str) -> WorstMoment | None:
    """The tick with the most of `ns`; its severity is the share of the period."""
    if not ns.size or ns.max() <= 0:
        return None
    row = int(ns.argmax())
    tick, value, period = int(run.timing[row, 0]), 1e-6 * float(ns[row]), scenario.control.period
    return WorstMoment(kind, tick * period, tick, value, "ms", text.format(value=value), 1e-3 * value / period)


def _infeasible(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    """The longest stretch of successive ticks at which nothing met the constraints."""
    ticks, status = run.ticks.tolist(), run.trajectory.status
    stretches = groupby(range(len(status)), lambda row: (status[row] in INFEASIBLE, ticks[row] - row))
    longest = max((list(rows) for (bad, _), rows in stretches if bad), key=len, default=[])
    if not longest:
        return None
    seconds = len(longest) * scenario.control.period
    text = f"for {len(longest)} tick{'s' * (len(longest) > 1)} no control met the constraints"
    return _at(run, longest[0], "infeasible", seconds, "s", text, seconds / STUCK)


def _localization(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    error = np.hypot(*consistency.robot_error(run.trajectory)[:, :2].T)
    return _largest(run, "localization", error, "believes itself {value:.2f} m off", LOST)


def _tracking(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    error = np.linalg.norm(consistency.track_error(run.trajectory)[..., :2], axis=-1)
    return _largest(run, "tracking", error, "believes person{person} {value:.2f} m off", MISJUDGED)


def _ess(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    """The belief of which the smallest share of particles counts."""
    ess = np.column_stack([run.trajectory.robot_ess, run.trajectory.people_ess])
    particles = np.full(ess.shape, scenario.estimation.obstacles.particles, float)
    particles[:, 0] = consistency.robot_particles(run.trajectory, scenario)
    share = ess / particles
    if (place := _worst(-share)) is None:
        return None
    (row, body), value, of = place, ess[place], int(particles[place])
    name = "the robot" if body == 0 else f"person{body - 1}"
    severity = DEPLETED / max(share[place], 1e-3)
    return _at(run, row, "ess", value, "particles", f"{value:.1f} of {name}'s {of} particles count", severity)


def _deviation(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    distance = progress.lateral_distance(run.trajectory.robot_pose[:, :2], progress.way(scenario))
    return _largest(run, "deviation", distance, "{value:.2f} m beside the way", ASTRAY)


def _gap(run: LoggedRun, scenario: Scenario) -> WorstMoment | None:
    missing = np.diff(run.ticks) - 1
    if not missing.size or missing.max() <= 0:
        return None
    row = int(missing.argmax())
    ticks, seconds = int(missing[row]), missing[row] * scenario.control.period
    return _at(run, row, "gap", seconds, "s", f"the {ticks} ticks after this one are missing", seconds / SILENT)


_KINDS: tuple[Callable[[LoggedRun, Scenario], WorstMoment | None], ...] = (
    *(_contact, _clearance, _infeasible, _gap, _lateness, _longest_tick),
    *(_localization, _tracking, _ess, _deviation),
)

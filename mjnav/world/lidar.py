"""Planar lidar: errors of the returns, and the times of the beams.

Exact ranges become what a lidar returns by footprint and mixed pixels, missing returns, errors, steps and limits. A
beam has a width. Its footprint is sampled by three rays: through the middle and along both edges. Where they meet one
surface, the middle ray's range counts. Where they meet two, at an edge, the light of both returns, and a share of such
beams, the mixed pixels, has a range anywhere between the near and the far surface.

Sources: Tuley, Vandapel and Hebert, Analysis and removal of artifacts in 3-D LADAR data, ICRA 2005, and Photonics
5(2):12, 2018 (mixed pixels); Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 6.3 (errors and missing
returns of a beam).

A lidar takes all its beams at a reading's moment, or in packets while it turns. A turning lidar takes its beams one
after the other. Here they are cast in packets, groups of about PACKET seconds, each from where the robot and everybody
else really are at the packet's moment; `times` tells that moment. So a scan of a robot that moves is distorted as a
real one is.
"""

import numpy as np

from mjnav.compile.compiled import Matrix, exact
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.scene.sensors import Lidar
from mjnav.scene.spec import Scenario
from mjnav.world.draws import NEVER, Grid
from mjnav.world.engine import Engine

# ------------------------------------------------------------------------------------------ returns


EDGE = 0.05  # [m] that the middle ray departs from the line through the others' points: two surfaces, no flat one


class Returns:
    """What a lidar returns, and its draws: as many from every stream for each scan, whatever there is to see."""

    def __init__(self, lidar: Lidar, noise: Distribution, seed: int):
        self._lidar, self._noise, self._has_own_errors = lidar, noise, lidar.has_own_errors
        self._errors = stream(seed, "lidar.range")
        is_wide = lidar.beam_width > 0.0
        self._mixed = stream(seed, "lidar.mixed") if is_wide else None
        loses = any(share > 0.0 for _, share in lidar.missing_rows)
        self._missing = stream(seed, "lidar.missing") if loses else None
        half = 0.5 * lidar.beam_width
        self._rays = np.array([0.0, half, -half] if is_wide else [0.0])[:, None] + lidar.angles

    @property
    def num_rays(self) -> int:
        """Of each beam."""
        return len(self._rays)

    def rays(self, start: int, stop: int) -> Array:
        """(num_rays, n) [rad] against the mount's heading of the beams from `start` on, the middle ones first."""
        return self._rays[:, start:stop]

    def measure(self, exact_ranges: Array) -> Array:
        """What returns (B,) [m], inf for nothing, of the rays' exact ranges (num_rays, B)."""
        lidar, num_beams = self._lidar, exact_ranges.shape[1]
        ranges = exact_ranges[0]
        if self._mixed is not None:
            ranges = footprint(exact_ranges, lidar.beam_width, lidar.mixed, self._mixed.random((2, num_beams)))
        hits = np.isfinite(ranges) & (ranges >= lidar.min_range)
        if self._missing is not None:
            hits &= self._missing.random(num_beams) >= lidar.missing(ranges)
        measured = ranges + self._draw_errors(ranges)
        if lidar.resolution > 0.0:
            measured = lidar.resolution * np.round(measured / lidar.resolution)
        if self._has_own_errors:
            hits &= (measured >= lidar.min_range) & (measured <= lidar.max_range)
        else:
            measured = np.clip(measured, lidar.min_range, lidar.max_range)
        return np.where(hits, measured, np.inf)

    def _draw_errors(self, ranges: Array) -> Array:
        """Of each beam [m]: the lidar's own by range, in the shape of the noise profile's law, or that law's."""
        lidar, noise = self._lidar, self._noise
        draws = noise.sample(self._errors, len(ranges))
        if not self._has_own_errors:
            return draws
        shape = (draws - noise.mean) / noise.std if noise.std > 0.0 else np.zeros(len(ranges))
        return lidar.bias(ranges, noise) + lidar.std(ranges, noise) * shape


@exact
def footprint(rays: Matrix, width: float, mixed: float, draws: Matrix):
    """The range of each beam, (B,) [m], from its middle ray and the two at its edges, rays (3, B).

    With ranges m, l, r and h half the width, three points lie on a line where 2 cos(h)/m = 1/l + 1/r. Where m departs
    from that by more than EDGE, there are two surfaces. Then, where draws[0] < mixed, the range is
    near + draws[1] (far - near). A beam whose middle meets nothing returns from what its edges meet.
    """
    ranges = rays[0].copy()
    for i in range(len(ranges)):
        middle, left, right = rays[0, i], rays[1, i], rays[2, i]
        near, far = min(middle, left, right), max(middle, left, right)
        if not np.isfinite(middle):
            ranges[i] = near
        elif np.isfinite(far) and far - near > EDGE and near > 0.0:
            on_line = 2.0 * np.cos(0.5 * width) / (1.0 / left + 1.0 / right)
            if abs(middle - on_line) > EDGE and draws[0, i] < mixed:
                ranges[i] = near + draws[1, i] * (far - near)
    return ranges


# ----------------------------------------------------------------------------------------- scanners


PACKET = 0.01  # [s]


class AtOnce:
    """All beams at the moment of each reading."""

    next = NEVER  # the step at which the next packet is due

    def __init__(self, lidar: Lidar, returns: Returns):
        self._lidar, self._returns = lidar, returns

    def take(self, engine: Engine, step: int) -> None:
        """Casts the packet that is due at the present step, if one is."""

    def scan(self, engine: Engine) -> tuple[Array, Array]:
        """For a reading: ranges (B,) [m] and times (B,) [s] of the beams.

        No ranges where nothing new is complete, and no times where all beams are of the reading's moment.
        """
        return self._returns.measure(_cast(engine, self._lidar, self._returns, 0, len(self._lidar.angles))), np.zeros(0)


class Turning:
    """A turn after the other, in packets; of those turns that no reading brings, none is cast.

    A reading brings the turn that was completed last, once. The first reading, before which nothing was, brings a whole
    turn of its own moment.
    """

    def __init__(self, lidar: Lidar, rate: float, returns: Returns, scenario: Scenario):
        self._lidar, self._returns, self._timestep = lidar, returns, scenario.physics.timestep
        self._slots = max(1, min(round(1.0 / (rate * PACKET)), int(1.0 / (rate * self._timestep))))  # of a turn
        self._moments = Grid(1.0 / (rate * self._slots), self._timestep)
        self._readings = Grid(1.0 / scenario.sensors.rate, self._timestep)
        slot = np.floor(lidar.turn_offsets * rate * self._slots + 1e-9).astype(int)
        slots, starts = np.unique(slot, return_index=True)
        # Of each packet: its slot in the turn, its first beam, the one after its last beam.
        self._packets = list(zip(slots.tolist(), starts.tolist(), [*starts[1:].tolist(), len(slot)], strict=True))
        self._ranges = np.zeros((returns.num_rays, len(slot)))
        self._times = np.zeros(len(slot))
        self._turn, self._packet = -1, 0
        self._complete: tuple[Array, Array] | None = None
        self._is_first = True
        self._begin_turn()

    def _begin_turn(self) -> None:
        """Goes to the next turn that a reading brings: one comes after its last packet and before the next turn's."""
        last = self._packets[-1][0]
        while True:
            self._turn += 1
            completed = self._moments.step_of(self._turn * self._slots + last)
            following = self._moments.step_of((self._turn + 1) * self._slots + last)
            if self._readings.first_from(completed) < following:
                break
        self._packet = 0
        self._schedule()

    def _schedule(self) -> None:
        self.next = self._moments.step_of(self._turn * self._slots + self._packets[self._packet][0])

    def take(self, engine: Engine, step: int) -> None:
        """See `AtOnce`."""
        if step < self.next:
            return
        _, start, stop = self._packets[self._packet]
        self._ranges[:, start:stop] = _cast(engine, self._lidar, self._returns, start, stop)
        self._times[start:stop] = step * self._timestep
        self._packet += 1
        if self._packet < len(self._packets):
            self._schedule()
            return
        self._complete = self._returns.measure(self._ranges), self._times.copy()
        self._begin_turn()

    def scan(self, engine: Engine) -> tuple[Array, Array]:
        """See `AtOnce`."""
        if self._is_first:
            self._is_first = False
            whole = _cast(engine, self._lidar, self._returns, 0, len(self._times))
            return self._returns.measure(whole), np.zeros(0)
        complete, self._complete = self._complete or (np.zeros(0), np.zeros(0)), None
        return complete


def scanner(scenario: Scenario, seed: int) -> AtOnce | Turning:
    """The lidar of a scenario."""
    lidar = scenario.sensors.scanner
    returns = Returns(lidar, scenario.noise.distributions()["lidar.range"], seed)
    return AtOnce(lidar, returns) if lidar.rate is None else Turning(lidar, lidar.rate, returns, scenario)


def _cast(engine: Engine, lidar: Lidar, returns: Returns, start: int, stop: int) -> Array:
    """The exact ranges (num_rays, n) of the rays of the beams from `start` to before `stop`."""
    angles = returns.rays(start, stop)
    return engine.cast(lidar.mount, angles.reshape(-1), lidar.max_range).reshape(angles.shape)

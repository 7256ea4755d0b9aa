"""How many frames of a recording's column pass in a second, where nobody has said it."""

from dataclasses import dataclass

import numpy as np

from mjnav.scenarios.crowd.reader import Recording

RATES = (25.0, 30.0, 29.97, 50.0, 60.0, 24.0, 20.0, 16.0, 15.0, 12.5, 12.0, 10.0, 8.0, 7.5, 5.0, 2.5, 2.0, 1.0)  # usual
STEP = 0.4  # [s] between the annotated frames of ETH (Pellegrini et al. 2009), UCY (Lerner et al. 2007) and their heirs
FREE_SPEED = 1.34  # [m/s] of people who walk freely (Weidmann 1993)
_WALKING = (0.6, 2.2)  # [m/s] between which the median speed of people who walk lies in any recording of walkers
_LEAST = 1e-12  # [m/frame] of a step
_SLOW = 0.25  # of the fastest tenth's speed: slower steps are people who stand


@dataclass(frozen=True, slots=True)
class RateGuess:
    """A frame rate, what speaks for it, and whether that is enough to go on."""

    frame_rate: float
    basis: str
    sure: bool


def guess_frame_rate(recording: Recording, scale: float = 1.0) -> RateGuess | None:
    """The likely frame rate; None where nobody has two rows. `scale` are metres a unit of the file."""
    same = np.diff(recording.person) == 0
    frames = np.diff(recording.frame)[same]
    if not len(frames):
        return None
    way = scale * np.hypot(*np.diff(recording.position, axis=0)[same].T)
    if recording.velocity is not None:
        rate = _by_velocities(recording, same, frames, way, scale)
        if rate is not None:
            return RateGuess(rate, "the recorded velocities", True)
    speed = _walking_speed(way / frames)  # [m/frame]
    step = recording.usual_step
    if step > 0.0 and _WALKING[0] <= speed * step / STEP <= _WALKING[1]:
        rate = _neat(step / STEP)
        return RateGuess(rate, f"steps of {step:g} frames as {STEP:g} s: people walk at {speed * rate:.2f} m/s", True)
    rate = min(RATES, key=lambda one: abs(np.log(max(speed, _LEAST) * one / FREE_SPEED)))
    walking = speed * rate
    return RateGuess(rate, f"the usual rate at which people walk at {walking:.2f} m/s", False)


def _by_velocities(
    recording: Recording, same: np.ndarray, frames: np.ndarray, way: np.ndarray, scale: float
) -> float | None:
    """Speed of the velocity columns over distance a frame, of the steps in which people walk."""
    assert recording.velocity is not None
    told = scale * np.hypot(*recording.velocity.T)
    told = 0.5 * (told[:-1] + told[1:])[same]
    walked = way / frames
    moving = walked > max(_SLOW * np.quantile(walked, 0.9), _LEAST)
    if not moving.any() or not told[moving].any():
        return None
    return _neat(float(np.median(told[moving] / walked[moving])))


def _walking_speed(speeds: np.ndarray) -> float:
    """The median speed of steps that are no standing, in the unit of `speeds`."""
    return float(np.median(speeds[speeds >= _SLOW * np.quantile(speeds, 0.9)]))


def _neat(rate: float) -> float:
    """The usual rate within 2 % of it, or else three digits."""
    nearest = min(RATES, key=lambda one: abs(one - rate))
    return nearest if abs(nearest - rate) <= 0.02 * rate else float(f"{rate:.3g}")

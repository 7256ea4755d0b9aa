"""One heading in (-pi, pi], compiled into the kernels that need it; `angles.wrap` is the same for arrays."""

from math import pi

from mjnav.geometry.compiled import scalar

_LEAST = -3.1415926535897927  # `angles.LEAST`


@scalar
def wrapped(angle):
    """The same angle in (-pi, pi] [rad]."""
    if -pi < angle <= pi:
        return angle
    return max(pi - (pi - angle) % (2.0 * pi), _LEAST)

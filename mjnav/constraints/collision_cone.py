"""The collision cone f of two discs, safe where f <= 0.

With r the relative position, q the relative velocity, R the sum of the radii:

    line      f = (r.q)^2 / |q|^2 - |r|^2 + R^2        the paper's: least distance from the whole line r + t q
    ray       as line where r.q < 0, else R^2 - |r|^2   what moves away is as near as it will get
    segment   f = R^2 - |r + t* q|^2, t* = clip(-r.q / |q|^2, 0, horizon)

Where |q| < 1e-9 every form is R^2 - |r|^2. Source of the line form: Nair et al., arXiv 2112.13034; of the cone itself:
Fiorini & Shiller (1998), "Motion Planning in Dynamic Environments Using Velocity Obstacles".
"""

from math import inf
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import kernel, scalar
from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import Array, finite, number

LINE, RAY, SEGMENT = 0, 1, 2
FORMS = MappingProxyType({"line": LINE, "ray": RAY, "segment": SEGMENT})
STANDSTILL = 1e-18  # [m^2/s^2], |q|^2 below which there is no direction
FARTHEST = 1e70  # [m], [m/s]: products of four are floats
TINY = 1e-300  # [m^2/s^2], so that |q|^2 can be divided by


@scalar
def cone_line(rx, ry, qx, qy, radius_squared, horizon):
    """f of the line form; `horizon` is not used."""
    qq = qx * qx + qy * qy
    rq = rx * qx + ry * qy
    moving = rq * rq / max(qq, STANDSTILL)
    return (moving if qq >= STANDSTILL else 0.0) - (rx * rx + ry * ry) + radius_squared


@scalar
def cone_ray(rx, ry, qx, qy, radius_squared, horizon):
    """f of the ray form; `horizon` is not used."""
    qq = qx * qx + qy * qy
    rq = min(rx * qx + ry * qy, 0.0)
    moving = rq * rq / max(qq, STANDSTILL)
    return (moving if qq >= STANDSTILL else 0.0) - (rx * rx + ry * ry) + radius_squared


@scalar
def cone_segment(rx, ry, qx, qy, radius_squared, horizon):
    """f of the segment form, R^2 - |r|^2 - t* (2 r.q + t* |q|^2), from |q|^2 t* = clip(-r.q, 0, horizon |q|^2).

    With a finite horizon and |q| below 1e-9 this is R^2 - |r|^2 up to 2e-9 horizon |r|; where q = 0, exactly.
    """
    qq = qx * qx + (qy * qy + TINY)
    towards = max(-(rx * qx + ry * qy), 0.0)
    way = min(towards, horizon * qq)
    return (radius_squared - (rx * rx + ry * ry)) + way * (towards + (towards - way)) / qq


@kernel
def _cone(out, rx, ry, qx, qy, radius, form, horizon):
    if form == LINE:
        for i in range(out.size):
            out[i] = cone_line(rx[i], ry[i], qx[i], qy[i], radius[i] * radius[i], horizon)
    elif form == RAY:
        for i in range(out.size):
            out[i] = cone_ray(rx[i], ry[i], qx[i], qy[i], radius[i] * radius[i], horizon)
    else:
        for i in range(out.size):
            moves = qx[i] * qx[i] + qy[i] * qy[i] >= STANDSTILL
            x, y = (qx[i], qy[i]) if moves else (0.0, 0.0)
            out[i] = cone_segment(rx[i], ry[i], x, y, radius[i] * radius[i], horizon)


def collision_cone(
    relative_position: ArrayLike,
    relative_velocity: ArrayLike,
    combined_radius: ArrayLike,
    *,
    form: str = "segment",
    horizon: float | None = None,
) -> Array:
    """f [m^2], safe where f <= 0, for r and q of shape (..., 2) and R of shape (...), which broadcast.

    `form` is line, ray or segment; `horizon` [s] bounds the segment form's time (None: no bound). Raises InvalidValue.
    """
    if not isinstance(form, str) or form not in FORMS:
        raise unknown_name("form", form, FORMS)
    bound = inf if horizon is None or (isinstance(horizon, float) and horizon == inf) else number("horizon", horizon)
    if not bound > 0.0:
        raise InvalidValue("horizon", horizon, "a number > 0, or None")
    r = finite("relative_position", relative_position, ..., 2, unit="m", most=FARTHEST)
    q = finite("relative_velocity", relative_velocity, ..., 2, unit="m/s", most=FARTHEST)
    radius = finite("combined_radius", combined_radius, ..., unit="m", most=FARTHEST)
    try:
        columns = np.broadcast_arrays(r[..., 0], r[..., 1], q[..., 0], q[..., 1], radius)
    except ValueError:
        shapes = r.shape, q.shape, radius.shape
        raise InvalidValue("shapes", shapes, "(..., 2), (..., 2) and (...), which broadcast") from None
    out = np.empty(columns[0].shape)
    flat = [np.array(column, order="C").reshape(-1) for column in columns]
    _cone(out.reshape(-1), *flat, FORMS[form], bound)
    return out[()]

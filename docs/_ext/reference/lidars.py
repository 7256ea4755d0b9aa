"""The lidars that a run file names, with their figures."""

from itertools import pairwise
from math import degrees

from mjnav.scene.sensors import LIDARS, ByRange, LidarModel

from .markdown import escape


def markdown() -> str:
    """A table of the models but `ideal`, which has the keys beside it and the noise profile."""
    head = ["", "beams", "field of view", "turns a second", "range [m]", "bias [mm]", "spread [mm]", "source"]
    rows = [_row(name, model) for name, model in LIDARS.items() if model.rate is not None]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def _row(name: str, model: LidarModel) -> list[str]:
    assert model.bias is not None
    assert model.spread is not None
    return [
        f"`{name}`",
        str(model.beams),
        f"{degrees(model.field_of_view):g}°",
        f"{model.rate:g}",
        f"{model.min_range:g} to {model.max_range:g}",
        _by_range(model.bias),
        _by_range(model.spread),
        escape(model.source),
    ]


def _by_range(rows: ByRange) -> str:
    """Each piece: "5 (to 0.5 m), 8.75 to 61.25 (to 3.5 m)"."""
    if len(rows) == 1:
        return f"{1e3 * rows[0][1]:.4g}"
    pieces = []
    for (start, low), (end, high) in pairwise(rows):
        if end > start:
            value = f"{1e3 * low:.4g}" if low == high else f"{1e3 * low:.4g} to {1e3 * high:.4g}"
            pieces.append(f"{value} (to {end:g} m)")
    return ", ".join(pieces)

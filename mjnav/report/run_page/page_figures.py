"""The figures of `mjnav inspect --json` as HTML: every figure bears its key and its raw value.

`pack_consistency` packs two series over time: whether beliefs are as sure as they may be (NEES), and how many of their
particles count (effective sample size).
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array, Trajectory
from mjnav.metrics.consistency import COVERED, people_nees, region, robot_nees, robot_particles
from mjnav.report.figure_text import by_group, definition, unit
from mjnav.report.look.document import term
from mjnav.report.run_page.packed import Packer
from mjnav.scene.spec import Scenario

MOST = 1e6  # of NEES over its bound: what is infinite is drawn there


def pack_consistency(
    packer: Packer, trajectory: Trajectory, scenario: Scenario, rows: NDArray[np.intp], people_ess: Array
) -> None:
    """Packs `nees`, the NEES of the robot and the largest of people's over the bound of their 95 % region, (F, 2).

    And `ess`, the effective sample size of the robot's belief and the least of people's over the number of particles,
    (F, 2). `rows` are the frames' rows of the trajectory, of which the last is the state at its end; `people_ess` is
    the least of people's at each frame.
    """
    largest = np.fmax.reduce(people_nees(trajectory), axis=1, initial=np.nan) / region(COVERED, 4)
    nees = np.column_stack([robot_nees(trajectory) / region(COVERED, 3), largest])
    robot = trajectory.robot_ess / robot_particles(trajectory, scenario)
    ess = np.column_stack([_at(robot, rows), people_ess / scenario.estimation.obstacles.particles])
    packer.numbers("nees", np.minimum(_at(nees, rows), MOST).astype(np.float32))
    packer.numbers("ess", ess.astype(np.float32))


def _at(values: Array, rows: NDArray[np.intp]) -> Array:
    """The rows of a figure of ticks; NaN for the state at the end."""
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])[rows]


DASH = "–"
WHO_HIT = "Who hit whom"  # a card of runs in which a person was touched


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure: its key in the document, what it is called, its unit."""

    key: str
    label: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Card:
    """Figures that belong together, the first in large letters."""

    label: str
    figures: tuple[Figure, ...]


def _quantiles(key: str, unit: str) -> tuple[Figure, ...]:
    names = (("p50", "median"), ("p99", "99 %"), ("max", "longest"))
    return tuple(Figure(f"{key}.{part}", name, unit) for part, name in names)


CARDS = (
    Card("Time", (Figure("figures.time_s", "", "s"), Figure("timing.real_time_factor", "× real time"))),
    Card("Least clearance", (Figure("figures.min_clearance_m", "", "m"),)),
    Card(
        "Collisions",
        tuple(Figure(f"figures.collisions.{kind}", kind) for kind in ("person", "table", "wall", "pillar")),
    ),
    Card(
        WHO_HIT,
        (
            Figure("figures.robot_at_fault", "the robot's fault"),
            Figure("figures.collisions_moving", "while it moved"),
            Figure("figures.collisions_at_rest", "while it stood"),
        ),
    ),
    Card(
        "Distance from people",
        (
            Figure("figures.min_human_distance_m", "least", "m"),
            Figure("figures.personal_space_share", "of the time below 1.2 m"),
            Figure("figures.min_time_to_collision_s", "least time to collision", "s"),
        ),
    ),
    Card(
        "Detour of people",
        (
            Figure("figures.detour.displacement_m", "from where they would be", "m"),
            Figure("figures.detour.path_m", "farther", "m"),
            Figure("figures.detour.delay_s", "later", "s"),
        ),
    ),
    Card("People who see the robot", (Figure("figures.people_see_robot", ""),)),
    Card(
        "Path",
        (
            Figure("figures.path_length_m", "", "m"),
            Figure("figures.path_ratio", "times"),
            Figure("figures.straight_line_m", "straight", "m"),
        ),
    ),
    Card(
        "Deviation",
        (Figure("figures.mean_deviation_m", "mean", "m"), Figure("figures.max_deviation_m", "greatest", "m")),
    ),
    Card("Control cost", (Figure("figures.control_cost", "", "m²/s³"),)),
    Card("Stalled", (Figure("figures.stalled_s", "", "s"),)),
    Card("Over a lane", (Figure("figures.lane_violation_s", "", "s"),)),
    Card("Infeasible ticks", (Figure("figures.infeasible_ticks", ""), Figure("figures.ticks", "ticks in all"))),
    Card(
        "Error of beliefs, RMSE",
        (Figure("figures.localization_rmse_m", "robot", "m"), Figure("figures.tracking_rmse_m", "people", "m")),
    ),
    Card(
        "Tracks against people",
        (
            Figure("figures.gospa_m", "GOSPA", "m"),
            Figure("figures.tracked_share", "of the time with a track"),
            Figure("figures.identity_switches", "identity switches"),
        ),
    ),
    Card(
        "Coverage of 95 % regions",
        (Figure("figures.robot_coverage", "robot"), Figure("figures.people_coverage", "people")),
    ),
    Card("Time of a decision", _quantiles("timing.compute_ms.control", "ms")),
    Card("Time of a tick", _quantiles("timing.compute_ms.tick", "ms")),
    Card("Deadlines missed", (Figure("timing.deadline_misses", ""),)),
)


def flatten(document: Any, prefix: str = "") -> dict[str, Any]:
    """Every leaf of a JSON document under its dotted key; an empty object or list is a leaf."""
    parts: Any = ()
    if isinstance(document, Mapping):
        parts = document.items()
    elif isinstance(document, list | tuple):
        parts = enumerate(document)
    if not parts:
        return {prefix: document}
    return {
        key: leaf
        for name, part in parts
        for key, leaf in flatten(part, f"{prefix}.{name}" if prefix else str(name)).items()
    }


def shown(value: Any) -> str:
    """A value for people: three digits, thousands apart, a dash for what is unknown."""
    if value is None or value == {} or value == []:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
    if isinstance(value, float):
        return (f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:.3g}").replace("-", "−")
    return str(value)


def element(run: int, key: str, value: Any, unit: str = "", *, strong: bool = False) -> str:
    """One figure; `data-value` is the raw value as JSON."""
    raw = escape(json.dumps(value))
    name = "strong" if strong else "span"
    tail = f' <span class="unit">{escape(unit)}</span>' if unit and value is not None else ""
    return f'<{name} data-run="{run}" data-key="{escape(key)}" data-value="{raw}">{escape(shown(value))}</{name}>{tail}'


def cards(flat: Mapping[str, Any]) -> str:
    """The key figures of one run; what a log does not have makes no card."""
    hit = bool(flat.get("figures.collisions.person"))
    known = [card for card in CARDS if any(flat.get(figure.key) is not None for figure in card.figures)]
    known = [card for card in known if hit or card.label != WHO_HIT]
    found = "\n".join(_card(card, flat) for card in known)
    return f'<section class="figures" aria-label="Key figures">{found}</section>'


def _card(card: Card, flat: Mapping[str, Any]) -> str:
    first, *rest = card.figures
    equal = card.label == "Collisions"
    shown_too = card.figures if equal else [figure for figure in rest if flat.get(figure.key) is not None]
    rows = [f"<span{_title(figure)}>{_labelled(figure, flat)}</span>" for figure in shown_too]
    head = "" if equal else f'<p class="figure"{_title(first)}>{_labelled(first, flat, strong=True)}</p>'
    tail = f"<p>{' '.join(rows)}</p>" if rows else ""
    heading = term(card.label, _definitions(card, [first, *shown_too]))
    return f'<div class="card{" equal" if equal else ""}"><h2>{heading}</h2>{head}{tail}</div>'


def _title(figure: Figure) -> str:
    return f' title="{escape(definition(figure.key))}"'


def _definitions(card: Card, figures: Sequence[Figure]) -> str:
    """What the figures of a card are, a line each."""
    lines = dict.fromkeys(f"{figure.label or card.label}: {definition(figure.key)}" for figure in figures)
    return "\n".join(lines) if len(lines) > 1 else definition(figures[0].key)


def _labelled(figure: Figure, flat: Mapping[str, Any], *, strong: bool = False) -> str:
    label = f' <span class="what">{escape(figure.label)}</span>' if figure.label else ""
    return element(0, figure.key, flat.get(figure.key), figure.unit, strong=strong) + label


def comparison(runs: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """The key figures of several runs in columns, each with its difference from the first; headings are HTML."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading, _ in runs)
    rows = [("Outcome", Figure("figures.outcome", ""))]
    rows += [(card.label, figure) for card in CARDS for figure in card.figures]
    body = []
    for label, figure in rows:
        values = [flat.get(figure.key) for _, flat in runs]
        if all(value is None for value in values):
            continue
        name = f"{label}, {figure.label}" if figure.label else label
        unit = f' <span class="unit">{escape(figure.unit)}</span>' if figure.unit else ""
        cells = "".join(
            f"<td>{element(i, figure.key, value)}{_difference(value, values[0]) if i else ''}</td>"
            for i, value in enumerate(values)
        )
        body.append(f'<tr><th scope="row">{term(name, definition(figure.key))}{unit}</th>{cells}</tr>')
    table = f'<table class="comparison"><thead><tr><td></td>{head}</tr></thead><tbody>{"".join(body)}</tbody></table>'
    return f'<section class="figures"><h2>Figures</h2>{table}</section>'


def _difference(value: Any, first: Any) -> str:
    if isinstance(value, bool) or not (isinstance(value, int | float) and isinstance(first, int | float)):
        return ""
    change = value - first
    text = f"{'+' if change > 0 else ''}{shown(float(f'{change:.3g}'))}" if change else "="
    return f' <span class="difference">{text}</span>'


def _named(key: str) -> str:
    return term(key, definition(key) if key.startswith("figures.") else "", reach=False)


def figure_table(run: int, flat: Mapping[str, Any]) -> str:
    """All leaves of `flat` in two columns; figures of the run come first, each with its unit, under their groups."""
    groups = by_group(key for key in flat if key.startswith("figures."))
    parts = [(name, {key: flat[key] for key in keys}) for name, keys in groups.items()]
    parts.append(("", {key: value for key, value in flat.items() if not key.startswith("figures.")}))
    bodies = "".join(
        f'<tbody>{f"""<tr><th scope="rowgroup" colspan="2">{escape(name)}</th></tr>""" if name else ""}'
        + "".join(
            f'<tr><th scope="row">{_named(key)}</th><td>{_valued(run, key, one)}</td></tr>' for key, one in own.items()
        )
        + "</tbody>"
        for name, own in parts
        if own
    )
    return f'<table class="all">{bodies}</table>'


def _valued(run: int, key: str, value: Any) -> str:
    return element(run, key, value, unit(key.removeprefix("figures.").replace(".", "_")))

"""The figures of `mjnav inspect --json` as HTML: every figure bears its key and its raw value.

What a figure is called and its unit come from its definition (`mjnav.metrics`).
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from mjnav.metrics.summary import FIGURES
from mjnav.report.figure_text import by_group, definition, unit
from mjnav.report.look.document import term

# Figures that belong together, the first in large letters.
CARDS = (
    ("time_s", "real_time_factor"),
    ("min_clearance_m",),
    (*(f"collisions_{kind}" for kind in ("person", "table", "wall", "pillar")), "robot_at_fault"),
    ("min_human_distance_m", "personal_space_share", "min_time_to_collision_s"),
    ("detour_displacement_m", "detour_path_m", "detour_delay_s"),
    ("people_see_robot",),
    ("path_length_m", "path_ratio", "straight_line_m"),
    ("mean_deviation_m", "max_deviation_m"),
    ("control_cost",),
    ("stalled_s",),
    ("lane_violation_s",),
    ("infeasible_ticks", "ticks"),
    ("localization_rmse_m", "tracking_rmse_m"),
    ("gospa_m", "tracked_share", "identity_switches"),
    ("robot_coverage", "people_coverage"),
    *(tuple(f"compute_ms_{phase}_{level}" for level in ("p50", "p99", "max")) for phase in ("control", "tick")),
    ("deadline_misses",),
)
DASH = "–"


def key_of(figure: str) -> str:
    """Where a figure stands in the document that `mjnav inspect --json` prints."""
    known = FIGURES[figure]
    return f"{'timing' if known.group == 'computing' else 'figures'}.{known.name}"


def flatten(document: Any, prefix: str = "") -> dict[str, Any]:
    """Every leaf of a JSON document under its dotted key; an empty object or list is a leaf."""
    is_list = isinstance(document, list)
    parts = document.items() if isinstance(document, dict) else enumerate(document) if is_list else ()
    leaves: dict[str, Any] = {}
    for name, part in parts:
        leaves |= flatten(part, f"{prefix}.{name}" if prefix else str(name))
    return leaves or {prefix: document}


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


def element(run: int, key: str, value: Any, unit: str = "", *, name: str = "span") -> str:
    """One figure; `data-value` is the raw value as JSON."""
    raw = escape(json.dumps(value))
    tail = f' <span class="unit">{escape(unit)}</span>' if unit and value is not None else ""
    return f'<{name} data-run="{run}" data-key="{escape(key)}" data-value="{raw}">{escape(shown(value))}</{name}>{tail}'


def table(kind: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are HTML; the first cell of each row is its heading. Without `head`, it has none."""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    body = "".join(f'<tr><th scope="row">{first}</th>{"".join(map("<td>{}</td>".format, rest))}</tr>'
                   for first, *rest in rows)  # fmt: skip
    return f'<table class="{kind}">{f"<thead><tr>{top}</tr></thead>" if head else ""}<tbody>{body}</tbody></table>'


def cards(flat: Mapping[str, Any]) -> str:
    """The key figures of one run; what a log does not have makes no card."""
    known = [[name for name in names if flat.get(key_of(name)) is not None] for names in CARDS]
    found = "\n".join(_card(names, flat) for names in known if names)
    return f'<section class="figures" aria-label="Key figures">{found}</section>'


def _card(names: Sequence[str], flat: Mapping[str, Any]) -> str:
    first, *rest = (FIGURES[name] for name in names)
    about = "\n".join(f"{one.words}: {one.about}" for one in (first, *rest)) if rest else first.about
    heading = term(first.words[0].upper() + first.words[1:], about)
    large = element(0, key_of(first.column), flat[key_of(first.column)], first.unit, name="strong")
    rows = " ".join(
        f'<span title="{escape(one.about)}">{element(0, key_of(one.column), flat[key_of(one.column)], one.unit)} '
        f'<span class="what">{escape(one.words)}</span></span>'
        for one in rest
    )
    return f'<div class="card"><h2>{heading}</h2><p class="figure">{large}</p>{f"<p>{rows}</p>" if rows else ""}</div>'


def comparison(runs: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """The key figures of several runs in columns, each with its difference from the first; headings are HTML."""
    rows = []
    for name in ("outcome", *(name for names in CARDS for name in names)):
        key, known = key_of(name), FIGURES[name]
        values = [flat.get(key) for _, flat in runs]
        if any(value is not None for value in values):
            unit = f' <span class="unit">{escape(known.unit)}</span>' if known.unit else ""
            cells = (element(i, key, value) + _difference(value, values[0]) * (i > 0) for i, value in enumerate(values))
            rows.append((term(known.words, known.about) + unit, *cells))
    figures = table("comparison", ("", *(heading for heading, _ in runs)), rows)
    return f'<section class="figures"><h2>Figures</h2>{figures}</section>'


def _difference(value: Any, first: Any) -> str:
    if isinstance(value, bool) or not (isinstance(value, int | float) and isinstance(first, int | float)):
        return ""
    change = value - first
    text = f"{'+' if change > 0 else ''}{shown(float(f'{change:.3g}'))}" if change else "="
    return f' <span class="difference">{text}</span>'


def figure_tables(run: int, flat: Mapping[str, Any]) -> str:
    """All leaves of `flat`: the figures of the run first, each with its unit, a table for each of their groups."""
    groups = by_group(key for key in flat if key.startswith("figures."))
    rest = [key for key in flat if not key.startswith("figures.")]
    return "".join(
        f"{f'<h4>{escape(group)}</h4>' if group else ''}"
        + table("all", (), ((_named(key), element(run, key, flat[key], unit(key))) for key in keys))
        for group, keys in (*groups.items(), ("", rest))
        if keys
    )


def _named(key: str) -> str:
    return term(key, definition(key) if key.startswith("figures.") else "", reach=False)

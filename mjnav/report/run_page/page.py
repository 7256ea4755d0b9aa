"""`mjnav report`: one HTML file with everything in it that shows what happened in a run, or in several side by side.

The page asks the network for nothing: its policy forbids it, and allows no script or style but its own, by their
hashes. Figures come from what `mjnav inspect --json` prints, and from nothing else.
"""

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from hashlib import sha256
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from mjnav.report.run_page import page_figures, page_parts

LETTERS = "ABCD"
MAX_RUNS = len(LETTERS)
GENERATOR = '<meta name="generator" content="mjnav report">'  # by which a page is known
_SCRIPTS = ("unpack", "drawing", "map", "distribution", "plots", "quantities", "playback", "page")


def page(inspections: Sequence[Mapping[str, Any]], runs: Sequence[Mapping[str, Any]]) -> str:
    """The page of one to MAX_RUNS runs: what `inspect` and `run_data` say of each, in the same order."""
    letters = LETTERS[: len(runs)]
    scripts = [_asset(f"{name}.js") for name in _SCRIPTS]
    style = _asset("page.css")
    several = len(runs) > 1
    flat = [page_figures.flatten(inspection) for inspection in inspections]
    fields = {
        "generator": GENERATOR,
        "policy": _policy(scripts, style),
        "style": style,
        "title": escape(_title(inspections)),
        "headline": _headline(inspections),
        "notices": _notices(inspections, runs, letters),
        "cards": "" if several else _cards(flat[0]),
        "comparison": _comparison(inspections, flat, letters) if several else "",
        "layout": "several" if several else "single",
        "runs": "".join(_run_block(i, inspection, letters) for i, inspection in enumerate(inspections)),
        "moments": page_parts.moments(inspections, letters),
        "events": page_parts.events(runs, letters),
        "log": "".join(_log_section(i, inspection, letters) for i, inspection in enumerate(inspections)),
        "inspections": _script_json(list(inspections)),
        "data": _script_json([{**run, "letter": letter} for run, letter in zip(runs, letters, strict=True)]),
        "scripts": "\n".join(f"<script>{script}</script>" for script in scripts),
    }
    return Template(_asset("page.html")).substitute(fields)


def _asset(name: str) -> str:
    return (files("mjnav.report.run_page") / "web" / name).read_text(encoding="utf-8")


def _policy(scripts: Sequence[str], style: str) -> str:
    """The page's content security policy: nothing but what is in it."""
    hashes = [f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in (*scripts, style)]
    parts = ("default-src 'none'", f"script-src {' '.join(hashes[:-1])}", f"style-src {hashes[-1]}", "img-src data:")
    return "; ".join((*parts, "base-uri 'none'", "form-action 'none'"))


def _script_json(document: Any) -> str:
    """JSON that cannot end the script element that it stands in."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _title(inspections: Sequence[Mapping[str, Any]]) -> str:
    names = [f"{page_parts.scene_name(one)}, {page_parts.heading(one)}" for one in inspections]
    return " | ".join(names)


def _headline(inspections: Sequence[Mapping[str, Any]]) -> str:
    """The scene, or the number of runs, in large letters; how one run ended."""
    scenes = list(dict.fromkeys(page_parts.scene_name(one) for one in inspections))
    if len(inspections) == 1:
        about, end = page_parts.heading(inspections[0]), page_parts.badge(0, inspections[0])
        return f'<h1>{escape(scenes[0])}</h1><p class="about">{escape(about)}</p>{end}'
    number = f"{len(inspections)} runs side by side"
    mixed = " of different scenes: differences compare unlike with unlike" if len(scenes) > 1 else ""
    return f'<h1>{escape(", ".join(scenes))}</h1><p class="about">{number}{mixed}</p>'


def _cards(flat: Mapping[str, Any]) -> str:
    return f'<section class="figures" aria-label="Key figures">{page_figures.cards(flat)}</section>'


def _comparison(inspections: Sequence[Mapping], flat: Sequence[Mapping[str, Any]], letters: str) -> str:
    heads = [f"{page_parts.run_letter(i, letters)} {_about(one)}" for i, one in enumerate(inspections)]
    return f'<section class="figures"><h2>Figures</h2>{page_figures.comparison(flat, heads)}</section>'


def _about(inspection: Mapping[str, Any]) -> str:
    return escape(f"{page_parts.scene_name(inspection)}, {page_parts.heading(inspection)}")


def _notices(inspections: Sequence[Mapping], runs: Sequence[Mapping], letters: str) -> str:
    items = [
        f"<li>{page_parts.run_letter(i, letters)}{escape(text)}</li>"
        for i, (inspection, run) in enumerate(zip(inspections, runs, strict=True))
        for text in page_parts.notices(inspection, run)
    ]
    return f'<ul class="notices">{"".join(items)}</ul>' if items else ""


def _run_block(i: int, inspection: Mapping[str, Any], letters: str) -> str:
    """The map of one run, what it does at the moment, and the distribution of its closest obstacle."""
    name = ""
    if len(letters) > 1:
        name = f"<h2>{page_parts.run_letter(i, letters)} {_about(inspection)}</h2>{page_parts.badge(i, inspection)}"
    return Template(_asset("run.html")).substitute(name=name)


def _log_section(i: int, inspection: Mapping[str, Any], letters: str) -> str:
    title = f"{page_parts.run_letter(i, letters)}{escape(str(inspection.get('path', '')))}"
    topics = page_parts.topics(i, inspection)
    details = page_parts.details(i, inspection, expanded=len(letters) == 1)
    return f'<h3>{title}</h3><div class="log">{topics}<div>{details}</div></div>'

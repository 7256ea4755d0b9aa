"""The terms of a reward, as the environment has them."""

from mjnav.gym.reward import PUBLISHED, TERMS

from .markdown import escape


def markdown() -> str:
    """A table of the terms."""
    weights = {name: f"{PUBLISHED[name]:g}" if name in PUBLISHED else "–" for name in TERMS}
    rows = [
        f"| `{name}` | {escape(term.formula)} | {escape(term.source)} | {weights[name]} |"
        for name, term in TERMS.items()
    ]
    return "\n".join(["| term | value of a step | source | default weight |", "|---|---|---|---|", *rows])

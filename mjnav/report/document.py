"""The frame of a page: its head with the shared style and the content security policy, and its scripts."""

import re
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from importlib.resources import files

_COMMENT = re.compile(r"^[ \t]*(?:/\*(?:(?!\*/).)*\*/|//[^\n]*)[ \t]*$", re.MULTILINE | re.DOTALL)
ICON = "data:,"  # none, so that a browser asks for none


def asset(package: str, name: str) -> str:
    """A style or script that lies in a package."""
    return (files(package) / name).read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Frame:
    """The style and the scripts of one kind of page, each of which its policy allows by its hash."""

    generator: str  # by which a page is known
    style: str
    scripts: tuple[str, ...]
    images: str = "data:"  # where pictures may come from

    @property
    def policy(self) -> str:
        """Nothing but what is in the page, and the pictures beside it where it has some."""
        allowed = " ".join(map(_digest, self.scripts)) or "'none'"
        parts = ("default-src 'none'", f"script-src {allowed}", f"style-src {_digest(self.style)}")
        return "; ".join((*parts, f"img-src {self.images}", "base-uri 'none'", "form-action 'none'"))

    def head(self, title: str) -> str:
        """The head element. `title` is text."""
        return "\n".join(
            (
                '<head>\n<meta charset="utf-8">',
                f'<meta name="generator" content="{self.generator}">',
                f'<meta http-equiv="Content-Security-Policy" content="{self.policy}">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                '<meta name="color-scheme" content="light dark">',
                f"<title>{escape(title)}</title>",
                f'<link rel="icon" href="{ICON}">',
                f"<style>{self.style}</style>\n</head>",
            )
        )

    @property
    def script_elements(self) -> str:
        """The scripts, for the end of the body."""
        return "\n".join(f"<script>{script}</script>" for script in self.scripts)


def frame(
    generator: str, package: str, styles: Sequence[str], scripts: Sequence[str] = (), *, beside: bool = False
) -> Frame:
    """The frame of a page; its styles and scripts lie in `package`. `beside`: it shows pictures beside its file."""
    own = asset("mjnav.report", "look/look.css") + "".join(asset(package, name) for name in styles)
    code = (asset("mjnav.report", "look/definitions.js"), *(asset(package, name) for name in scripts))
    images = "'self' file: data:" if beside else "data:"
    return Frame(generator, _flush(own), tuple(map(_flush, code)), images)


def term(text: str, definition: str, *, reach: bool = True) -> str:
    """HTML of a text with its definition; `reach`: also by the Tab key."""
    if not definition:
        return escape(text)
    stop = ' tabindex="0"' if reach else ""
    return f'<span class="term"{stop} title="{escape(definition)}">{escape(text)}</span>'


def _flush(text: str) -> str:
    """Without indentation, and comments that have lines of their own; no script has a string of several lines."""
    return "\n".join(line.strip() for line in _COMMENT.sub("", text).splitlines() if line.strip())


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"

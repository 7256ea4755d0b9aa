"""Which column of a recording holds what: said by the user, named by a header line, or by the number of columns."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from mjnav.errors import InvalidValue

IGNORED = "-"
COLUMNS = ("frame", "id", "x", "y", "vx", "vy", IGNORED)
REQUIRED = ("frame", "id", "x", "y")
OBSMAT = ("frame", "id", "x", IGNORED, "y", "vx", IGNORED, "vy")  # of ETH, with z upwards
HEIGHT = 3  # the place of z in it
# number of columns -> what they are, where nothing else says so
BY_NUMBER: Mapping[int, tuple[str, ...]] = MappingProxyType({4: REQUIRED, 8: OBSMAT})
FORMATS = "frame id x y (4 columns) or frame id x z y vx vz vy (8 columns, obsmat)"
SAID = "columns that are said (crowd.columns)"
# Names in header lines, in small letters without units and marks.
_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "frame": "frame frames frameid framenumber frameno fr time t timestamp",
        "id": "id ids ped pedid pedestrian pedestrianid person personid persid track trackid agent agentid",
        "x": "x posx xpos px positionx xposition xcenter",
        "y": "y posy ypos py positiony yposition ycenter",
        "vx": "vx velx velocityx xvelocity",
        "vy": "vy vely velocityy yvelocity",
    }
)


def check_columns(key: str, columns: Sequence[str]) -> None:
    """Each of frame, id, x and y once, velocities both or none. Raises InvalidValue."""
    counts = {name: list(columns).count(name) for name in COLUMNS if name != IGNORED}
    known = all(name in COLUMNS for name in columns)
    if not known or any(counts[name] != 1 for name in REQUIRED) or (counts["vx"], counts["vy"]) not in ((0, 0), (1, 1)):
        allowed = f"each of {', '.join(REQUIRED)} once, vx and vy if they are there, {IGNORED!r} for every other column"
        raise InvalidValue(key, " ".join(columns), allowed)


@dataclass(frozen=True, slots=True)
class Header:
    """The last line before the rows that has words, under its number; `marked` as a comment or not."""

    line: int
    words: tuple[str, ...]
    marked: bool

    def columns(self, width: int) -> tuple[str, ...] | None:
        """What the line names of rows of `width` columns; None where it is no header of theirs.

        Raises InvalidValue for a header that does not name the columns that are needed.
        """
        if len(self.words) != width:
            return None
        named = named_columns(self.words)
        is_header = not self.marked or sum(_name(word) != IGNORED for word in self.words) > 1
        if named is None and is_header:
            allowed = f"a header that names each of {', '.join(REQUIRED)} once, or {SAID}"
            raise InvalidValue(f"line {self.line}", " ".join(self.words), allowed)
        return named


def named_columns(header: Sequence[str]) -> tuple[str, ...] | None:
    """What the words of a header line name; None where they do not name each of frame, id, x and y once.

    A second column of time beside the frame is ignored.
    """
    found = [_name(word) for word in header]
    frames = [i for i, name in enumerate(found) if name == "frame"]
    if len(frames) > 1:
        kept = next((i for i in frames if _plain(header[i]).startswith("fr")), frames[0])
        found = [IGNORED if i in frames and i != kept else name for i, name in enumerate(found)]
    if any(found.count(name) > 1 for name in _NAMES) or not all(name in found for name in REQUIRED):
        return None
    both = "vx" in found and "vy" in found
    return tuple(IGNORED if name in ("vx", "vy") and not both else name for name in found)


def _name(word: str) -> str:
    plain = _plain(word)
    return next((name for name, known in _NAMES.items() if plain in known.split()), IGNORED)


def _plain(word: str) -> str:
    """A word without unit, marks and capitals: "X[m]" is x, "ped_id" pedid."""
    return re.sub(r"[^a-z]", "", re.sub(r"[\[(/].*", "", word.lower()))

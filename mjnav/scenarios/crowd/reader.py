"""Reader of recordings of people's tracks: text files with one row for each person and frame.

The user says what each column holds, or a header line names the columns, or their number tells.

Rows may come in any order. Columns are separated by white space, commas or semicolons. Lines that begin with #, %, //
or ;, and lines without any number before the first row, are comments or headers. A line that is not marked as a comment
and has as many words as the rows have columns is a header: where it does not name the columns, the user has to say
what they hold.
"""

import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.toml import read_regular

# ------------------------------------------------------------------------------------------ columns


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


# --------------------------------------------------------------------------------------------- rows


MAX_BYTES = 100_000_000
_LARGEST = 1e15  # of a number: beyond any clock and any map
MAX_STEPS = 1_000_000  # from the median frame to the others: 9 hours at 30 Hz, 4 days of annotated steps of 0.4 s
_DIGITS = 6  # of a person's frames, which are equal where they are nearer
_COMMENT = re.compile(r"\s*(#|%|//|;)")
_NUMBERED = ("frame", "x", "y", "vx", "vy")


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The R rows of a recording by person and frame; persons in the order in which they first appear in time.

    Its arrays cannot be written to: who reads the same file again gets the same recording.
    """

    columns: tuple[str, ...]
    labels: tuple[str, ...]  # id of each person, as the file has it
    person: NDArray[np.int64]  # (R,) index into labels, ascending
    frame: Array  # (R,) ascending for each person
    position: Array  # (R, 2) in the file's unit
    velocity: Array | None  # (R, 2) where the file has it
    num_skipped: int  # lines of comments and headers
    num_repeated: int  # rows whose person and frame, to 10^-6, another row had before them

    def rows(self) -> Iterator[tuple[str, slice]]:
        """Label and rows of each person."""
        ends = np.searchsorted(self.person, np.arange(len(self.labels) + 1))
        for label, first, last in zip(self.labels, ends[:-1], ends[1:], strict=True):
            yield label, slice(int(first), int(last))

    @property
    def usual_step(self) -> float:
        """The median step between two rows of a person, in frames; at least 10^-6; 0 where nobody has two."""
        steps = np.diff(self.frame)[np.diff(self.person) == 0]
        return float(np.quantile(steps, 0.5, method="lower").round(_DIGITS)) if len(steps) else 0.0


def read_recording(path: Path | str, columns: Sequence[str] | None = None) -> Recording:
    """The recording in a text file; `columns` says what its columns are (`crowd.columns`).

    Of rows with the same person and frame the first counts. Raises InvalidValue with the file and the line.
    """
    if columns is not None:
        check_columns("columns", columns)
    try:
        data = read_regular(path, MAX_BYTES)
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidValue("", None, f"a recording that can be read ({reason})", file=str(path)) from None
    try:
        return _recording(data, None if columns is None else tuple(columns))
    except InvalidValue as error:
        raise error.within(file=str(path)) from None


@lru_cache(2)
def _recording(data: bytes, columns: tuple[str, ...] | None) -> Recording:
    """The recording in a file's bytes. All cells of a study read the same file, one after the other."""
    return _parsed(_text(data), columns)


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InvalidValue(
            f"line {line}", data[error.start : error.end], f"text in UTF-8 or UTF-16: {FORMATS}"
        ) from None
    if "\0" in text:
        raise InvalidValue(
            f"line {text.count(chr(10), 0, text.index(chr(0))) + 1}", "\0", f"text in UTF-8 or UTF-16: {FORMATS}"
        )
    return text


def _parsed(text: str, columns: Sequence[str] | None) -> Recording:
    """The recording in a text; the keys of errors are lines."""
    header = Header(0, (), marked=True)
    skipped, width = 0, 0
    labels: dict[str, int] = {}
    people, lines, values = array("q"), array("q"), array("d")  # a large file's rows take 8 bytes a number
    numbered: list[tuple[int, str]] = []
    place_of_id = 0
    height: array[float] | None = None  # z of rows that are taken for obsmat by their number of columns alone
    for number, line in enumerate(text.splitlines(), start=1):
        words = _words(line)
        if not words:
            continue
        if _COMMENT.match(line) or (not values and not any(map(_is_number, words))):
            skipped += 1
            found = () if values else _words(_COMMENT.sub("", line, count=1))
            header = Header(number, tuple(found), marked=_COMMENT.match(line) is not None) if found else header
            continue
        if not values:
            is_said = columns is not None or header.columns(len(words)) is not None
            columns = _columns(number, words, header, columns)
            height = None if is_said or columns != OBSMAT else array("d")
            width, place_of_id = len(columns), columns.index("id")
            numbered = [(columns.index(name), name) for name in _NUMBERED if name in columns]
        if len(words) != width:
            raise InvalidValue(f"line {number}", line.strip(), f"{width} columns, as in the rows before")
        lines.append(number)
        people.append(labels.setdefault(_label(words[place_of_id]), len(labels)))
        values.extend(_number(words[place], number, name) for place, name in numbered)
        if height is not None:
            height.append(float(words[HEIGHT]) if _is_number(words[HEIGHT]) else 0.0)
    if not values or columns is None:
        raise InvalidValue("", "no rows", f"rows of {FORMATS}")
    rows = np.array(values).reshape(-1, len(numbered))
    if height is not None:
        _check_height(np.array(height), rows[:, 2])
    recording = _sorted(tuple(columns), tuple(labels), np.array(people), rows, skipped)
    _check_extent(recording, rows[:, 0], lines)
    return recording


def _check_extent(recording: Recording, frame: Array, lines: Sequence[int]) -> None:
    """Raises InvalidValue where frames, (R,) in the file's order, lie too far apart for the recording's usual step."""
    step, median = recording.usual_step, float(np.median(frame))
    far = int(np.argmax(np.abs(frame - median)))
    if step > 0.0 and abs(frame[far] - median) > MAX_STEPS * step:
        allowed = f"a frame within {MAX_STEPS} usual steps ({step:g}) of the median frame, {median:.15g}"
        raise InvalidValue(f"line {lines[far]}", float(frame[far]), allowed)


def _check_height(z: Array, y: Array) -> None:
    """Raises InvalidValue where what would be the height of obsmat spans more than y does: people walk on a floor."""
    up, across = np.ptp(z), np.ptp(y)
    if up > across:
        found = f"{len(OBSMAT)} columns, of which the fourth spans {up:.4g} and the fifth {across:.4g}"
        allowed = f"{FORMATS} with z upwards, a header line that names frame, id, x and y, or {SAID}"
        raise InvalidValue("", found, allowed)


def _words(line: str) -> list[str]:
    for separator in (",", ";"):
        if separator in line:
            words = [word.strip().strip("\"'") for word in line.split(separator)]
            return words[:-1] if words[-1] == "" else words
    return line.split()


def _columns(number: int, words: Sequence[str], header: Header, given: Sequence[str] | None) -> Sequence[str]:
    """What the columns of the first row are: as given, as its header names them, or by their number."""
    columns = given or header.columns(len(words)) or BY_NUMBER.get(len(words))
    if columns is None or len(columns) != len(words):
        found = f"{len(words)} columns: {' '.join(words)}"
        allowed = (
            f"{len(given)} columns: {' '.join(given)}"
            if given
            else (f"{FORMATS}, a header line that names frame, id, x and y, or {SAID}")
        )
        raise InvalidValue(f"line {number}", found, allowed)
    return columns


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _number(word: str, line: int, name: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not abs(value) < _LARGEST:
        raise InvalidValue(f"line {line}", word, f"a finite number ({name})")
    return value


def _label(word: str) -> str:
    """An id: 7, 7.0 and 7.0000000e+00 are the same; a word is as it is."""
    if word.isdecimal():
        return str(int(word)) if len(word) < 20 else word
    try:
        value = float(word)
    except ValueError:
        return word
    return str(int(value)) if value.is_integer() and abs(value) < 2**53 else word


def _sorted(
    columns: tuple[str, ...], labels: tuple[str, ...], person: NDArray[np.int64], values: Array, skipped: int
) -> Recording:
    """The rows by person and frame, each pair once."""
    frame = values[:, 0]
    first_seen = np.full(len(labels), np.inf)
    np.minimum.at(first_seen, person, frame)
    order_of_people = np.array(sorted(range(len(labels)), key=lambda i: (first_seen[i], _natural(labels[i]))))
    rank = np.empty(len(labels), np.int64)
    rank[order_of_people] = np.arange(len(labels))
    person = rank[person]
    order = np.lexsort((frame, person))  # stable: of repeated rows the first stays first
    person, values = person[order], values[order]
    repeated = (np.diff(person, prepend=-1) == 0) & (np.diff(values[:, 0], prepend=-np.inf) < 10.0**-_DIGITS)
    person, values = person[~repeated], values[~repeated]
    for rows in (person, values):
        rows.flags.writeable = False
    velocity = values[:, 3:5] if values.shape[1] == 5 else None
    return Recording(
        columns,
        tuple(labels[i] for i in order_of_people),
        person,
        values[:, 0],
        values[:, 1:3],
        velocity,
        skipped,
        int(repeated.sum()),
    )


def _natural(label: str) -> tuple[float, str]:
    """Numbers by their value, before words."""
    return (float(label), "") if _is_number(label) else (float("inf"), label)

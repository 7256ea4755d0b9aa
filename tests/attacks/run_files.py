"""Run files at random, from the definitions of the keys themselves: a key added later is fuzzed, too.

The keys are the fields of the scenario's dataclasses, of every method's parameters, of every distribution and of every
behaviour. The bounds of a number and the names that a string may have are read from the refusals that they give.
"""

import re
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from math import inf, isfinite, nextafter
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from hypothesis import strategies as st

from mjnav.control.registry import METHODS
from mjnav.errors import InputError
from mjnav.loop.prepare import build_controller
from mjnav.noise import CHANNELS
from mjnav.noise.registry import _DISTRIBUTIONS
from mjnav.scenarios import loads
from mjnav.scenarios.build import _keys
from mjnav.scenarios.dump import toml_text
from mjnav.scenarios.people import BEHAVIOURS
from mjnav.scenarios.spec import ChannelNoise, Control, LaneSpec, Latency, Noise, Person, Scenario

Table = dict[str, Any]
Path = tuple[str | int, ...]

# A value of every key that has no default, by its name.
EXAMPLES: Table = {
    "name": "fuzz",
    "start": [2.0, -1.5],
    "velocity": [0.3, 0.2],
    "waypoints": [[3.0, -1.5], [2.0, -1.5]],
    "from": [-1.0, -3.0],
    "to": [8.0, -3.0],
    "position": [3.0, 1.5],
    "left": [0.0, 1.0, -2.5],
    "right": [0.0, 1.0, 2.5],
    "std": 0.1,
    "half_width": 0.1,
    "df": 5.0,
    "skew": 0.5,
    "kurtosis": 4.0,
    "weights": [0.4, 0.6],
    "means": [-0.1, 0.1],
    "stds": [0.1, 0.2],
    "samples": [-0.1, 0.0, 0.2],
}
BASE: Table = {
    "schema": 1,
    "name": "fuzz",
    "robot": {"start": [0.0, 0.0, 0.0], "goal": [6.0, 0.0]},
    "physics": {"engine": "kinematic"},
}
ODD = (
    st.sampled_from([2**63, -(2**63), 10**400, 1e300, -1e300, 5e-324, 1e-12, 0, -1, -0.0, inf, -inf, float("nan")])
    | st.floats()
    | st.integers()
    | st.booleans()
    | st.text(max_size=5)
    | st.lists(st.floats() | st.integers(), max_size=4)
    | st.dictionaries(st.text(max_size=3), st.integers(), max_size=2)
)
NAMES = st.text(min_size=1, max_size=100) | st.sampled_from(
    [
        "界" * 100,
        "界" * 101,
        "🚶" * 50,
        "é",
        ".",
        "..",
        "...",
        "",
        "a/b",
        "a\x00b",
        "a\nb",
        "-rf",
        "\u202e",
        "~",
        " ",
        "\x1b[2J",
    ]
)


@dataclass(frozen=True, eq=False)
class Leaf:
    """One key: where it stands, what it holds, and the tables that it needs around it."""

    path: Path
    hint: Any
    default: object
    around: tuple[tuple[Path, Table], ...] = ()

    def put(self, document: Table, value: object) -> None:
        """Sets it in place; tables of another kind make room."""
        for path, table in self.around:
            found = _inner(document, path)
            if any(found.get(key) != table[key] for key in ("behaviour", "distribution", "method") if key in table):
                found.clear()
            for key, example in table.items():
                found.setdefault(key, deepcopy(example))
        _inner(document, self.path[:-1])[self.path[-1]] = value


def _inner(document: Table, path: Path) -> Any:
    inner: Any = document
    for part, following in zip(path, (*path[1:], ""), strict=False):
        if isinstance(inner, list):
            while len(inner) <= part:
                inner.append({})
            inner = inner[part]
        else:
            inner = inner.setdefault(part, [] if isinstance(following, int) else {})
    return inner


def _required(cls: Any, **more: object) -> Table:
    table = dict(more)
    for key, item in _keys(cls).items():
        if item.default is MISSING and item.default_factory is MISSING and key not in ("behaviour", "robot"):
            table[key] = EXAMPLES[key]  # a new key without a default needs an example above
    return table


def _leaves(cls: Any, path: Path, around: tuple[tuple[Path, Table], ...] = ()) -> Iterator[Leaf]:
    """The keys below a table that becomes a `cls`."""
    hints = get_type_hints(cls)
    for key, item in _keys(cls).items():
        hint = hints[item.name]
        if get_origin(hint) in (Union, UnionType):
            hint = next(option for option in get_args(hint) if option is not type(None))
        below = (*path, key)
        if cls is Person and key == "behaviour":
            for name, kind in BEHAVIOURS.items():
                yield from _leaves(kind, path, ((path, _required(kind, behaviour=name, start=EXAMPLES["start"])),))
        elif cls is Noise and key == "channels":
            for channel in CHANNELS:
                place = (*path, *channel.split("."))
                for name, kind in _DISTRIBUTIONS.items():
                    table = {"distribution": name, **_required_of(kind)}
                    for field in fields(kind):
                        if field.init:
                            default = None if field.default is MISSING else field.default
                            yield Leaf(
                                (*place, field.name), get_type_hints(kind)[field.name], default, ((place, table),)
                            )
        elif cls is Control and key == "parameters":
            for name, method in METHODS.items():
                kind = method.controller_class.parameters_type
                for field in fields(kind):
                    table = ((path, {"method": name}),)
                    yield Leaf((*path, field.name), get_type_hints(kind)[field.name], field.default, table)
        elif is_dataclass(hint):
            own = {Latency: {"trace": [0.01]}, LaneSpec: _required(LaneSpec)}.get(hint, {})
            yield from _leaves(hint, below, (*around, (below, own)) if own else around)
        elif get_origin(hint) is tuple and is_dataclass(get_args(hint)[0]):
            kind = get_args(hint)[0]
            first = (*below, 0)
            table = _required(kind) | (
                {"behaviour": "constant_velocity", "velocity": [0.3, 0.2]} if kind is Person else {}
            )
            yield from _leaves(kind, first, ((first, table),))
        elif hint is not ChannelNoise:
            yield Leaf(below, hint, None if item.default is MISSING else item.default, around)


def _required_of(kind: Any) -> Table:
    return {f.name: EXAMPLES[f.name] for f in fields(kind) if f.init and f.default is MISSING}


LEAVES = tuple(_leaves(Scenario, ()))
GROUPS = tuple(
    group
    for part in dict.fromkeys(leaf.path[0] for leaf in LEAVES)
    if len(group := tuple(leaf for leaf in LEAVES if leaf.path[0] == part)) > 1
)
ANY_LEAF = st.sampled_from(LEAVES) | st.sampled_from(GROUPS).flatmap(st.sampled_from)  # each key; each table as often


def refusal(leaf: Leaf, value: object) -> InputError | None:
    """What loading says of a document with that value in an otherwise good file."""
    document = deepcopy(BASE)
    leaf.put(document, value)
    try:
        build_controller(loads(toml_text(document)))
    except InputError as error:
        return error
    return None


def is_number(leaf: Leaf) -> bool:
    return leaf.hint in (float, int)


@cache
def bounds(leaf: Leaf) -> tuple[float, ...]:
    """The numbers that refusals name as the ends of what is allowed."""
    found: set[float] = set()
    for value in (-1e300, 1e300) if leaf.hint is float else (-(2**62), 2**62):
        if (error := refusal(leaf, value)) is not None:
            allowed = str(error).partition("allowed: ")[2]
            found |= {float(text) for text in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", allowed)}
    return tuple(sorted(found))


@cache
def choices(leaf: Leaf) -> tuple[str, ...]:
    """The names that a string may have; none where it may be anything."""
    error = refusal(leaf, "no such name")
    allowed = getattr(error, "allowed", "")
    return tuple(name for name in allowed.split(", ") if name and refusal(leaf, name) is None)


SHARES = st.sampled_from((1.0, 1.0, 1.0, 1.01, 0.5, 0.1, 0.01))


@st.composite
def at_a_bound(draw, leaf: Leaf) -> Any:
    """A number at one of its bounds, just below or just beyond, or a share of one."""
    bound = draw(st.sampled_from(bounds(leaf) or (0.0,)))
    if leaf.hint is int:
        return int(bound * draw(SHARES)) + draw(st.sampled_from((-1, 0, 0, 1)))
    value = bound * draw(SHARES)
    return draw(st.sampled_from((value, value, nextafter(value, -inf), nextafter(value, inf))))


def rarely(values: st.SearchStrategy, usual: object) -> st.SearchStrategy:
    """One of the values in one of ten draws."""
    return st.integers(0, 9).flatmap(lambda k: values if k == 0 else st.just(usual))


def modest(leaf: Leaf, hint: Any = None) -> st.SearchStrategy:
    """Values of the right type, most of which are allowed."""
    hint = hint or leaf.hint
    default = leaf.default if leaf.default is not None else EXAMPLES.get(str(leaf.path[-1]))
    if get_origin(hint) is tuple:
        kinds = get_args(hint)
        if kinds[-1] is Ellipsis:
            return st.lists(modest(leaf, kinds[0]), max_size=5)
        return st.tuples(*(modest(leaf, kind) for kind in kinds)).map(list)
    if hint is bool:
        return st.booleans()
    if hint is str:
        return st.sampled_from(choices(leaf)) if choices(leaf) else NAMES
    usual = default if isinstance(default, int | float) and not isinstance(default, bool) else 1.0
    usual = usual if isfinite(usual) else 5.0
    if leaf.path[-1] in ("rate", "timestep"):  # periods have to be whole numbers of steps
        return st.sampled_from((usual, 0.5 * usual, 2.0 * usual, 5.0 * usual))
    if hint is int:
        return st.integers(1, max(2, min(2 * int(usual), 200)))
    extreme = st.sampled_from((1e4, -1e4, 1e-9, 0.0))
    return st.floats(0.3, 2.0).map(lambda factor: factor * usual) | st.floats(-4.0, 4.0) | rarely(extreme, usual)


@st.composite
def run_files(draw, starts: tuple[Table, ...] = ()) -> Table:
    """Tables of a run file: a good one of which some values are others, some at their bounds, few wrong or unknown."""
    document = deepcopy(draw(st.sampled_from((BASE, *starts))))
    for _ in range(draw(st.integers(1, 8))):
        leaf = draw(ANY_LEAF)
        leaf.put(document, draw(modest(leaf)))
    for _ in range(draw(st.sampled_from((0, 1, 1, 2, 3)))):
        leaf = draw(ANY_LEAF)
        match draw(st.sampled_from((*["bound"] * 6, "odd", "gone", "unknown"))):
            case "bound" if is_number(leaf):
                leaf.put(document, draw(at_a_bound(leaf)))
            case "gone":
                leaf.put(document, 0)
                del _inner(document, leaf.path[:-1])[leaf.path[-1]]
            case "unknown":
                leaf.put(document, draw(modest(leaf)))
                _inner(document, leaf.path[:-1])[draw(st.text(max_size=5))] = draw(ODD)
            case "odd":
                leaf.put(document, draw(ODD))
            case _:  # the bounds of what is no number
                leaf.put(document, draw(modest(leaf)))
    return document

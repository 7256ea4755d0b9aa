"""Run files at random, from the definitions of the keys themselves: a key added later is fuzzed, too.

The keys are the fields of the scenario's dataclasses, of every method's parameters, of every distribution and of every
behaviour, with the ranges and the names that stand there.
"""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import MISSING, dataclass, is_dataclass
from math import inf, isfinite, nextafter
from typing import Any, get_args, get_origin

from hypothesis import strategies as st

from mjnav.control.registry import METHODS
from mjnav.scene.people import Trip
from mjnav.scene.prediction import Prediction
from mjnav.scene.spec import Control, Crowd, LaneSpec, Latency, Scenario
from mjnav.settings import Beside, Choice, Named, Range, Variants, keys
from mjnav.settings.marks import bare, mark, options

Table = dict[str, Any]
Path = tuple[str | int, ...]

# A value of every key that has no default, by its name.
EXAMPLES: Table = {
    "name": "fuzz", "file": "recording.txt", "frame_rate": 25.0,
    "start": [2.0, -1.5], "velocity": [0.3, 0.2], "waypoints": [[3.0, -1.5], [2.0, -1.5]],
    "track": [[0.0, 2.0, -1.5], [0.5, 2.5, -1.5], [2.0, 3.0, -1.0]],
    "from": [-1.0, -3.0], "to": [8.0, -3.0], "position": [3.0, 1.5],
    "left": [0.0, 1.0, -2.5], "right": [0.0, 1.0, 2.5],
    "std": 0.1, "half_width": 0.1, "df": 5.0, "skew": 0.5, "kurtosis": 4.0,
    "weights": [0.4, 0.6], "means": [-0.1, 0.1], "stds": [0.1, 0.2], "samples": [-0.1, 0.0, 0.2],
}  # fmt: skip
# What the file of that name holds.
RECORDING = "\n".join(f"{10 * i} {person} {2.0 + 0.5 * i} {person}" for person in (1, 2, 3) for i in range(8))
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
_ODD_NAMES = ("界" * 100, "界" * 101, "🚶" * 50, ".", "..", "...", "", "a/b", "a\0b", "a\nb", "-rf", "\u202e", "~", " ")
NAMES = st.text(min_size=1, max_size=100) | st.sampled_from([*_ODD_NAMES, "\x1b[2J"])


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
        if isinstance(inner, list) and isinstance(part, int):
            while len(inner) <= part:
                inner.append({})
            inner = inner[part]
        else:
            inner = inner.setdefault(part, [] if isinstance(following, int) else {})
    return inner


def _required(cls: Any, **more: object) -> Table:
    """The keys without a default, with their examples: a new such key needs one above."""
    required = (key for key, field in keys(cls).items() if field.default is MISSING and not field.beside)
    return more | {key: EXAMPLES[key] for key in required if key != "robot"}


def _leaves(cls: Any, path: Path, around: tuple[tuple[Path, Table], ...] = ()) -> Iterator[Leaf]:
    """The keys below a table that becomes a `cls`."""
    for key, field in keys(cls).items():
        if cls is Control and field.beside:
            for name, method in METHODS.items():
                yield from _leaves(method.controller_class.parameters_type, path, ((path, {"method": name}),))
        else:
            place = path if field.beside else (*path, key)
            default = None if field.default is MISSING else field.default
            yield from _leaves_of(field.hint, place, default, _required(cls) if field.beside else {}, around)


def _leaves_of(hint: Any, path: Path, default: object, owner: Table, around: tuple) -> Iterator[Leaf]:
    """The keys of a value; a table's are below it, and need it `around` them."""
    kind, variants, named = bare(hint), mark(hint, Variants), mark(hint, Named)
    if alternatives := options(hint):
        kind, hint = bare(alternatives[0]), alternatives[0]
    if named is not None:
        for name in named.names:
            yield from _leaves_of(get_args(kind)[1], (*path, *name.split(".")), None, {}, ())
    elif variants is not None:
        for name, one in variants.kinds.items():
            table = owner | _required(one, **{variants.key: name})
            yield from _leaves(one, path, ((path, table),))
    elif is_dataclass(kind):
        own = {
            Latency: {"trace": [0.01]},
            LaneSpec: _required(LaneSpec),
            Crowd: _required(Crowd),
            Prediction: {"model": "constant_velocity"},
        }.get(kind, {})
        yield from _leaves(kind, path, (*around, (path, own)) if own else around)
    elif get_origin(kind) is tuple and is_dataclass(get_args(kind)[0]):
        kind, first = get_args(kind)[0], (*path, 0)
        walking = any(mark(field.hint, Beside) for field in keys(kind).values())
        own = {"behaviour": "constant_velocity", "velocity": [0.3, 0.2]} if walking else {}
        if kind is Trip:
            area = [[2.0, -1.5], [3.0, -1.0]]
            own, around = {"from": area, "to": area}, (*around, (path[:-1], {"at_end": "again", "loop": False}))
        else:
            around = ()
        yield from _leaves(kind, first, (*around, (first, _required(kind) | own)))
    else:
        yield Leaf(path, hint, default, around)


LEAVES = tuple(_leaves(Scenario, ()))
GROUPS = tuple(
    group
    for part in dict.fromkeys(leaf.path[0] for leaf in LEAVES)
    if len(group := tuple(leaf for leaf in LEAVES if leaf.path[0] == part)) > 1
)
ANY_LEAF = st.sampled_from(LEAVES) | st.sampled_from(GROUPS).flatmap(st.sampled_from)  # each key; each table as often


def is_number(leaf: Leaf) -> bool:
    return bare(leaf.hint) in (float, int)


def choices(leaf: Leaf) -> tuple[str, ...]:
    """The names that a string may have; none where it may be anything."""
    found = mark(leaf.hint, Choice)
    return tuple(found.names) if found else (*METHODS, "no-such") if leaf.path[-1] == "method" else ()


SHARES = st.sampled_from((1.0, 1.0, 1.0, 1.01, 0.5, 0.1, 0.01))


@st.composite
def at_a_bound(draw, leaf: Leaf) -> Any:
    """A number at one of its bounds, just below or just beyond, or a share of one."""
    limits = mark(leaf.hint, Range)
    bound = draw(st.sampled_from((limits.low, limits.high)))
    if bare(leaf.hint) is int:
        return int(bound * draw(SHARES)) + draw(st.sampled_from((-1, 0, 0, 1)))
    value = bound * draw(SHARES)
    return draw(st.sampled_from((value, value, nextafter(value, -inf), nextafter(value, inf))))


def rarely(values: st.SearchStrategy, usual: object) -> st.SearchStrategy:
    """One of the values in one of ten draws."""
    return st.integers(0, 9).flatmap(lambda k: values if k == 0 else st.just(usual))


def modest(leaf: Leaf, hint: Any = None) -> st.SearchStrategy:
    """Values of the right type, most of which are allowed."""
    hint = bare(hint or leaf.hint)
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

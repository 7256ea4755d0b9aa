"""Every key of run files and study files, with the parameters of every method: what `mjnav keys` prints.

The same fields and marks make the JSON Schema (`file_schema`).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches

from mjnav import control
from mjnav.config.reference import INDEX, KeyReference, key_references
from mjnav.control import make_controller
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits
from mjnav.noise import CHANNELS
from mjnav.scenarios.layout.schema import draft_keys
from mjnav.scenarios.spec import Control, Scenario
from mjnav.study.study_file import StudyFile

_PERIOD = 1.0 / Control().rate  # [s] for which defaults are shown
_METHOD = "control.method"
_CHANNEL = "noise.CHANNEL"
_GIVEN_ELSEWHERE = "preferred_speed"  # a parameter that a run file has under [robot]
MAX_NEAREST = 3  # names that a misspelt key is answered with


def run_keys(controller: str | None = None) -> tuple[KeyReference, ...]:
    """Every key of a run file, tables before the keys in them.

    [control] has the parameters of one method, a shipped one or "package.module:Class", or of all shipped ones: each
    row then names its methods in `where`, and a parameter has several rows where its default depends on the method.
    Defaults are those for a period of 0.1 s. Raises InvalidValue where there is no such method.
    """
    parameters = [replace(row, where="") for row in _parameters(controller)] if controller else _all_parameters()
    rows = list(draft_keys([_required_schema(row) for row in key_references(Scenario)]))
    last = max(i for i, row in enumerate(rows) if row.key.startswith("control."))
    return (*rows[: last + 1], *parameters, *rows[last + 1 :])


def study_keys() -> tuple[KeyReference, ...]:
    """Every key of a study file; what its `set` and `grid` hold are keys of a run file."""
    return tuple(key_references(StudyFile))


def keys_below(rows: Sequence[KeyReference], prefix: str) -> tuple[KeyReference, ...]:
    """The rows whose key begins with `prefix`, or else those of which some part does.

    Indices and channels may be written out: people.0.radius, noise.gyro.std. Raises InvalidValue with the nearest keys
    where there are none.
    """
    general = _generalised(prefix)
    found = [row for row in rows if row.key == general or row.key.startswith(f"{general}.")]
    found = found or [row for row in rows if row.key.startswith(general)]
    found = found or [row for row in rows if any(part.startswith(general) for part in row.key.split("."))]
    if found:
        return tuple(found)
    nearest = _nearest(general, dict.fromkeys(row.key for row in rows))
    tops = sorted({row.key.partition(".")[0] for row in rows})
    allowed = f"a key or its beginning: {', '.join(nearest[1:] or tops)}"
    raise InvalidValue("PREFIX", prefix, allowed, nearest=nearest[0] if nearest else None)


def _generalised(prefix: str) -> str:
    """The prefix with N for every index and CHANNEL for a channel, as keys in the reference have them."""
    general = ".".join(INDEX if part.isdecimal() else part for part in prefix.strip(".").split("."))
    for channel in sorted(CHANNELS, key=len, reverse=True):
        place = f"noise.{channel}"
        if general == place or general.startswith(f"{place}."):
            return _CHANNEL + general.removeprefix(place)
    if any(f"noise.{channel}".startswith(f"{general}.") for channel in CHANNELS):
        return _CHANNEL
    return general


def _nearest(prefix: str, known: Iterable[str]) -> list[str]:
    """The keys most like a misspelt one: as a whole, or the last part of it alone."""
    known = list(known)
    close = get_close_matches(prefix, known, n=MAX_NEAREST, cutoff=0.7)
    if not close:
        lasts = {key.rpartition(".")[2]: key for key in reversed(known)}
        close = [lasts[name] for name in get_close_matches(prefix.rpartition(".")[2], lasts, n=MAX_NEAREST)]
    return close


def _parameters(method: str) -> Iterator[KeyReference]:
    """A method's parameters, with its own defaults."""
    own = make_controller(method, RobotLimits(), _PERIOD).parameters
    for row in key_references(type(own), "control.", defaults=own):
        if row.key != f"control.{_GIVEN_ELSEWHERE}":
            yield replace(row, where=method)


def _all_parameters() -> list[KeyReference]:
    """Those of every shipped method: rows that are the same but for the method are one."""
    methods: dict[str, tuple[KeyReference, list[str]]] = {}
    for name in control.names():
        for row in _parameters(name):
            methods.setdefault(repr(replace(row, where="")), (row, []))[1].append(name)
    rows = [replace(row, where=_where(names)) for row, names in methods.values()]
    order = {key: i for i, key in enumerate(dict.fromkeys(row.key for row in rows))}
    return sorted(rows, key=lambda row: order[row.key])


def _where(methods: list[str]) -> str:
    rest = [name for name in control.names() if name not in methods]
    if not rest:
        return ""
    return f"method = {', '.join(methods)}" if len(methods) <= len(rest) else f"method other than {', '.join(rest)}"


def _required_schema(row: KeyReference) -> KeyReference:
    """`schema` has a default in Python alone: a file says its version."""
    return replace(row, default=None, required=True) if row.key == "schema" else row

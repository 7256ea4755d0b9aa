"""Reference of the names and keys of run files and study files: lists, JSON Schemas and tables of keys.

`mjnav list` prints the catalogue: everything that run files, study files and options may name, with a sentence each.

The JSON Schemas of run files and study files have the parameters of every method.

`mjnav keys` prints the keys: every key of run files and study files, with the parameters of every method. The schemas
and the keys come from the same fields and marks.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from difflib import get_close_matches
from types import MappingProxyType

from mjnav import control, noise, scene
from mjnav.control.registry import shipped_parameters
from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import RobotLimits
from mjnav.noise.profiles import DISTRIBUTIONS
from mjnav.scene.drafts import draft_keys, is_random, with_draws
from mjnav.scene.people import TEMPERAMENTS
from mjnav.scene.prediction import MODELS
from mjnav.scene.robot import robots
from mjnav.scene.spec import BEHAVIOURS, ENGINES, Control, Scenario
from mjnav.settings import plugins
from mjnav.settings.reference import INDEX, KeyReference, key_references
from mjnav.settings.table import Schema, first_line, json_schema, table_schema, with_variants
from mjnav.study.study_file import StudyFile, studies

# ------------------------------------------------------------------------------------------ catalogue


def _with_registered(kind: type[plugins.Plugin], shipped: Mapping[str, str], prefix: str = "") -> dict[str, str]:
    """mjnav's own, and what installed packages register, with the package's name: nothing of it is imported."""
    found = dict(shipped)
    for name, points in plugins.registered(kind).items():
        owners = " and ".join(f"from {plugins.owner(point)} ({point.value})" for point in points)
        if prefix + name in shipped:
            found[prefix + name] += f"; also {owners}, so that neither can be named"
        else:
            found[prefix + name] = owners + (", so that neither can be named" if len(points) > 1 else "")
    return found


def _described(kinds: Mapping[str, type]) -> dict[str, str]:
    """The first line of each class's docstring."""
    return {name: first_line(kind) for name, kind in kinds.items()}


def _filters() -> dict[str, str]:
    """The values of estimation.robot and estimation.obstacles: source with filter, or localizer and tracker."""
    from mjnav.robot.estimation import LOCALIZERS, TRACKERS, estimator_class

    found: dict[str, str] = {}
    places = (("robot", LOCALIZERS, plugins.LocalizerPlugin), ("obstacles", TRACKERS, plugins.TrackerPlugin))
    for place, registry, kind in places:
        shipped = {f"{place}.{name}": first_line(estimator_class(path)) for name, path in registry.items()}
        found |= _with_registered(kind, shipped, f"{place}.{kind.noun}.")
    return found


def _topics() -> dict[str, str]:
    """The topics of a log, with the schema of their messages."""
    from mjnav.log.encode.topics import topics

    return {topic.name: f"{topic.text} ({topic.schema.name})" for topic in topics(scene.load("crossing1"))}


def _metrics() -> dict[str, str]:
    """The figures of a run and of `mjnav compare`, each with unit, definition and source; not the user's own."""
    from mjnav.metrics.summary import DERIVED, GROUPS

    found = {name: f"{group}: {one.line}" for group, figures in GROUPS.items() for name, one in figures.items()}
    return found | {name: f"compare: {one.line}" for name, one in DERIVED.items()}


def _scenes() -> dict[str, str]:
    """The shipped scenes; those that every seed draws anew say so."""
    return {name: text + " (drawn by seed)" * is_random(name) for name, text in scene.describe()}


# kind -> what finds its names, each with a sentence
KINDS: Mapping[str, Callable[[], Mapping[str, str]]] = MappingProxyType(
    {
        "scenes": _scenes,
        "studies": studies,
        "controllers": lambda: _with_registered(plugins.ControllerPlugin, control.describe()),
        "noise profiles": noise.describe_profiles,
        "behaviours": lambda: _with_registered(plugins.BehaviourPlugin, _described(dict(sorted(BEHAVIOURS.items())))),
        "temperaments": lambda: TEMPERAMENTS,
        "channels": lambda: noise.CHANNEL_MEANINGS,
        "distributions": lambda: _with_registered(plugins.DistributionPlugin, _described(DISTRIBUTIONS)),
        "filters": _filters,
        "predictors": lambda: _with_registered(plugins.PredictorPlugin, _described(MODELS)),
        "engines": lambda: ENGINES,
        "robots": robots,
        "topics": _topics,
        "metrics": _metrics,
    }
)


def catalogue() -> dict[str, Mapping[str, str]]:
    """Every kind, with its names and a sentence about each."""
    return {kind: find() for kind, find in KINDS.items()}


def names(kind: str) -> Mapping[str, str]:
    """The names of one kind, such as "scenes" or "noise profiles", with a sentence about each.

    Raises InvalidValue where there is no such kind.
    """
    wanted = str(kind).replace("-", " ").replace("_", " ")
    if wanted not in KINDS:
        raise unknown_name("kind", kind, [name.replace(" ", "-") for name in KINDS])
    return KINDS[wanted]()


# --------------------------------------------------------------------------------------- JSON Schemas


_PERIOD = 1.0 / Control().rate  # [s] for which defaults are shown


def run_schema() -> Schema:
    """Of a run file. [control] takes the parameters of its method, and any of a user's own."""
    schema = {"title": "mjnav run file", **with_draws(json_schema(Scenario))}
    tables = schema["$defs"]
    defaults = {name: shipped_parameters(name, _PERIOD) for name in control.names()}
    kinds = {name: table_schema(type(own), tables, own) for name, own in defaults.items()}
    tables["Control"] = with_variants(tables["Control"], "method", kinds, default=Control().method, open_end=True)
    trace = tables["Latency"]["properties"]["trace"]
    description = trace.pop("description")
    tables["Latency"]["properties"]["trace"] = {"description": description, "anyOf": [trace, {"type": "string"}]}
    return schema


def study_schema() -> Schema:
    """Of a study file. What it sets are keys of a run file, which the sweep checks: here they may be any."""
    schema = {"title": "mjnav study file", **json_schema(StudyFile)}
    controller = schema["$defs"]["MethodEntry"]["properties"]["controller"]
    controller["anyOf"] = [{"enum": list(control.names())}, {"pattern": ":"}]
    return schema


# ----------------------------------------------------------------------------------------------- keys


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
    for channel in sorted(noise.CHANNELS, key=len, reverse=True):
        place = f"noise.{channel}"
        if general == place or general.startswith(f"{place}."):
            return _CHANNEL + general.removeprefix(place)
    if any(f"noise.{channel}".startswith(f"{general}.") for channel in noise.CHANNELS):
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
    own = shipped_parameters(method, _PERIOD) or control.make_controller(method, RobotLimits(), _PERIOD).parameters
    if not is_dataclass(own):
        return
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

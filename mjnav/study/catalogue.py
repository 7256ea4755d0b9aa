"""Everything that run files, study files and options may name, with a sentence each: what `mjnav list` prints."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from mjnav import control, noise, scenarios
from mjnav.config.reference import first_line
from mjnav.errors import unknown_name
from mjnav.noise.registry import DISTRIBUTIONS
from mjnav.plugins import CONTROLLER, Kind, registered
from mjnav.plugins.kinds import BEHAVIOUR, DISTRIBUTION, LOCALIZER, PREDICTOR, TRACKER
from mjnav.scenarios.library import is_random
from mjnav.scenarios.people.temperament import TEMPERAMENTS
from mjnav.scenarios.prediction import MODELS
from mjnav.scenarios.spec import BEHAVIOURS, ENGINES
from mjnav.study.study_file import studies


def _with_registered(kind: Kind, shipped: Mapping[str, str], prefix: str = "") -> dict[str, str]:
    """mjnav's own, and what installed packages register, with the package's name: nothing of it is imported."""
    found = dict(shipped)
    for name, entries in sorted(registered(kind).items()):
        owners = " and ".join(f"from {entry.owner} ({entry.place})" for entry in entries)
        if prefix + name in shipped:
            found[prefix + name] += f"; also {owners}, so that neither can be named"
        else:
            found[prefix + name] = owners + (", so that neither can be named" if len(entries) > 1 else "")
    return found


def _filters() -> dict[str, str]:
    """The values of estimation.robot and estimation.obstacles: source with filter, or localizer and tracker."""
    from mjnav.estimation import LOCALIZERS, TRACKERS, estimator_class

    found: dict[str, str] = {}
    for place, registry, kind in (("robot", LOCALIZERS, LOCALIZER), ("obstacles", TRACKERS, TRACKER)):
        shipped = {f"{place}.{name}": first_line(estimator_class(path)) for name, path in registry.items()}
        found |= _with_registered(kind, shipped, f"{place}.{kind.name}.")
    return found


def _topics() -> dict[str, str]:
    """The topics of a log, with the schema of their messages."""
    from mjnav.recording.encode.topics import topics
    from mjnav.recording.log_format import TOPICS

    schemas = {topic.name: topic.schema.name for topic in topics(scenarios.load("crossing1"))}
    return {name: f"{text} ({schemas[name]})" for name, text in TOPICS.items()}


def _metrics() -> dict[str, str]:
    """The figures of a run and of `mjnav compare`, each with unit, definition and source; not the user's own."""
    from mjnav.metrics.definitions import DERIVED, GROUPS

    found = {name: f"{group}: {one.line}" for group, figures in GROUPS.items() for name, one in figures.items()}
    return found | {name: f"compare: {one.line}" for name, one in DERIVED.items()}


def _scenes() -> dict[str, str]:
    """The shipped scenes; those that every seed draws anew say so."""
    return {name: text + " (drawn by seed)" * is_random(name) for name, text in scenarios.describe()}


# kind -> what finds its names, each with a sentence
_KINDS: Mapping[str, Callable[[], Mapping[str, str]]] = MappingProxyType(
    {
        "scenes": _scenes,
        "studies": studies,
        "controllers": lambda: _with_registered(CONTROLLER, control.describe()),
        "noise profiles": noise.describe_profiles,
        "behaviours": lambda: _with_registered(
            BEHAVIOUR, {name: first_line(kind) for name, kind in sorted(BEHAVIOURS.items())}
        ),
        "temperaments": lambda: TEMPERAMENTS,
        "channels": lambda: noise.CHANNEL_MEANINGS,
        "distributions": lambda: _with_registered(
            DISTRIBUTION, {name: first_line(kind) for name, kind in DISTRIBUTIONS.items()}
        ),
        "filters": _filters,
        "predictors": lambda: _with_registered(PREDICTOR, {name: first_line(kind) for name, kind in MODELS.items()}),
        "engines": lambda: ENGINES,
        "topics": _topics,
        "metrics": _metrics,
    }
)


def kinds() -> tuple[str, ...]:
    """What there are names of."""
    return tuple(_KINDS)


def catalogue() -> dict[str, Mapping[str, str]]:
    """Every kind, with its names and a sentence about each."""
    return {kind: find() for kind, find in _KINDS.items()}


def names(kind: str) -> Mapping[str, str]:
    """The names of one kind, such as "scenes" or "noise profiles", with a sentence about each.

    Raises InvalidValue where there is no such kind.
    """
    wanted = str(kind).replace("-", " ").replace("_", " ")
    if wanted not in _KINDS:
        raise unknown_name("kind", kind, [name.replace(" ", "-") for name in _KINDS])
    return _KINDS[wanted]()

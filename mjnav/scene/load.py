"""Run files: from a shipped name, a path or a text to a checked scenario, and back to text."""

import json
import os
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from numbers import Integral
from pathlib import Path
from typing import Any

from mjnav import settings
from mjnav.errors import InvalidValue, unknown_name
from mjnav.output_files import path_text
from mjnav.scene import library
from mjnav.scene import toml as files
from mjnav.scene.check import check, check_memory, check_robot_way
from mjnav.scene.crowd import put_crowd
from mjnav.scene.drafts import draft_of
from mjnav.scene.floor_import import FLOORS, floor_tables
from mjnav.scene.map_file import put_map
from mjnav.scene.overrides import Overrides, apply, overrides_of
from mjnav.scene.random_scene import resolved
from mjnav.scene.robot import put_robot
from mjnav.scene.samples import put_samples
from mjnav.scene.spec import Control, Draft, Scenario
from mjnav.settings.plugins import placed

_LOOP = ("rate", "delay", "latency")  # keys of [control] that belong to the loop, not to the method
_KEPT_LAYOUTS = 64  # of random scenes, in a process: all methods of a study meet one before the next
_MAX_BYTES = 10_000_000  # of a run file; a device such as /dev/zero never ends


def load(
    name_or_path: str | os.PathLike[str],
    overrides: Overrides = (),
    *,
    controller: str | None = None,
    seed: int | None = None,
) -> Scenario:
    """The scenario of a shipped name, or of a path where there is a "/" or ".toml" at the end.

    Of a map (.yaml) or a world (.world) too, where `overrides` have robot.start and robot.goal.

    `controller` takes the place of control.method, keeps rate, delay and latency and drops the file's method
    parameters; `seed` takes the place of the file's; `overrides`, as values by dotted key or as "KEY=VALUE" each, come
    after both. Raises InvalidValue.
    """
    file, text = _read(name_or_path)
    if file.endswith(FLOORS) and not any(override.key.startswith("robot.") for override in overrides_of(overrides)):
        allowed = (
            "values for robot.start and robot.goal (--start X,Y,HEADING --goal X,Y): a map or a world has no robot"
        )
        raise InvalidValue("robot", None, allowed, file=file)
    return loads(text, overrides, file=file, folder=Path(file).parent, controller=controller, seed=seed)


def loads(
    text: str,
    overrides: Overrides = (),
    *,
    file: str = "scenario.toml",
    folder: Path | None = None,
    controller: str | None = None,
    seed: int | None = None,
    recorded: bool = False,
) -> Scenario:
    """The scenario that the text of a run file describes; `file` is its name in messages. Otherwise as `load`.

    What was `recorded` ran as it is: people without a way are let pass, as before routes were planned.

    Paths in it count from `folder`; without one they are refused, so that the text of a log opens no local file.
    """
    document = files.parse(text, file)
    if folder is not None:
        document = placed(document, folder)
    changed: dict[str, str] = {}  # key -> the argument that set it
    if controller is not None:
        control = document.get("control")
        own = control if isinstance(control, dict) else {}
        document["control"] = {"method": controller, **{key: own[key] for key in _LOOP if key in own}}
        changed["control.method"] = "controller"
    if seed is not None:
        document["seed"] = int(seed) if isinstance(seed, Integral) else seed
        changed["seed"] = "seed"
    for override in overrides_of(overrides):
        with settings.below(file=override.option):
            apply(document, override, _with_defaults(document))
        changed[override.key] = override.option
    try:
        files.inline(document, folder)
        put_robot(document, folder)
        put_samples(document, folder)
        put_map(document, folder)
        put_crowd(document, folder)
        scenario = _scenario(document, recorded=recorded)
    except InvalidValue as error:
        raise error.within(file=origin(error.key, file, changed)) from None
    return replace(scenario, source=file)


def _scenario(document: dict[str, Any], *, recorded: bool = False) -> Scenario:
    """The checked scenario of a file's tables; of a random scene, the layout of its seed. A log draws nothing."""
    draft = None if recorded else draft_of(document)
    if draft is not None:
        return _layout_of(document, draft)
    scenario = settings.read_document(Scenario, document)
    check_memory(scenario)
    check(scenario, routes=not recorded)
    if not recorded:
        check_robot_way(scenario)
    return scenario


def _layout_of(document: dict[str, Any], draft: Draft) -> Scenario:
    """The layout of a random scene's tables, drawn once for all controllers: only the loop's keys have a part in it."""
    control = document.get("control")
    if not isinstance(control, dict):
        return resolved(document, draft)
    try:
        tables = json.dumps({**document, "control": {key: control[key] for key in _LOOP if key in control}})
    except (TypeError, ValueError):  # what JSON cannot hold, such as a date
        return resolved(document, draft)
    drawn = _drawn(tables)
    with settings.below("control"):
        return replace(drawn, control=settings.read(Control, control))


def with_seed(scenario: Scenario, seed: int) -> Scenario:
    """The scenario under another seed; of a random scene with the layout of that seed, unless its file fixes one.

    Raises InvalidValue where no such layout can be drawn.
    """
    scenario = replace(scenario, seed=seed)
    draft = scenario.draft
    if draft is None:
        return scenario
    with settings.below(file=scenario.source):
        document = {key: value for key, value in _draft_tables(scenario, draft).items() if key != "control"}
        document["seed"] = draft.tables.get("layout", {}).get("seed", scenario.seed)
        drawn = _drawn(json.dumps(document))
    return replace(scenario, **{key: getattr(drawn, key) for key in ("layout", *draft.tables)})


@lru_cache(_KEPT_LAYOUTS)
def _drawn(tables: str) -> Scenario:
    """The layout of a random scene's tables, as JSON. The methods of a study meet it one after the other."""
    document = json.loads(tables)
    draft = draft_of(document)
    assert draft is not None  # asked for random scenes alone
    return resolved(document, draft)


def dumps(scenario: Scenario, *, draft: bool = False) -> str:
    """The scenario as TOML, every default explicit; `loads` makes an equal scenario of it.

    With `draft`, a random scene has its draws in place of what was drawn: under the same seed `loads` draws it again.
    """
    given = scenario.draft if draft else None
    found = tables(scenario) if given is None else _draft_tables(scenario, given)
    return files.toml_text({"schema": scenario.schema, **found})  # a reader wants the version first


def _draft_tables(scenario: Scenario, draft: Draft) -> dict[str, Any]:
    """The tables of a scenario, with the draft's in place of what was drawn."""
    found = {key: value for key, value in tables(scenario).items() if key != "layout"}
    return {**found, **draft.tables}


def tables(scenario: Scenario) -> dict[str, Any]:
    """The scenario as the tables of a run file, every default explicit."""
    document = settings.tables(scenario)
    if scenario.robot.goal is not None:
        del document["robot"]["waypoints"]  # the one or the other
    return document


def _read(name_or_path: str | os.PathLike[str]) -> tuple[str, str]:
    """The file's name in messages, and its text."""
    allowed = "a run file that can be read, or a shipped scene by name; a Scenario needs no loading: mjnav.run takes it"
    name = path_text("scene", name_or_path, allowed)
    if name.endswith(FLOORS):
        return name, files.toml_text(floor_tables(name, Path(name).parent)[0])
    if isinstance(name_or_path, str) and "/" not in name and not name.endswith(".toml"):
        path = str(library.data_folder("runs") / f"{name}.toml")
        if not os.path.isfile(path):  # Path.is_file raises for a name that is too long
            raise unknown_name("scene", name, library.names(), also="the path of a run file, .toml")
        name = path
    return name, read_text(name)


def read_text(name: str) -> str:
    """The text of a run file or study file. Raises InvalidValue where it cannot be read."""
    try:
        data = files.read_regular(name, _MAX_BYTES)
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        reason = getattr(error, "strerror", None) or str(error)
        allowed = f"a run file that can be read ({reason})"
        raise InvalidValue("", None, allowed, file=name, nearest=_nearest(name)) from None
    with settings.below(file=name):
        return files.decoded(data)


def _nearest(path: str) -> str | None:
    """The run file or shipped scene whose name is most like that of a path that cannot be read."""
    wanted = Path(path)
    try:
        siblings = [str(other) for other in wanted.parent.glob("*.toml") if other.is_file()]
    except (OSError, ValueError):
        siblings = []
    close = get_close_matches(str(wanted), siblings, n=1, cutoff=0.8)
    close = close or get_close_matches(wanted.stem, library.names(), n=1)
    return close[0] if close else None


def _with_defaults(document: dict[str, Any]) -> dict[str, Any]:
    """The tables with every default explicit; empty where they are no scenario yet, as overrides may complete them."""
    try:
        return tables(settings.read_document(Scenario, document))
    except InvalidValue:
        return {}


def origin(key: str, file: str, changed: dict[str, str]) -> str:
    """Where a value came from: the argument that set it, a part of it or a table around it; else the file."""
    for other, option in reversed(changed.items()):
        if f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}."):
            return option
    return f"{file or 'scenario'} with {', '.join(sorted(set(changed.values())))}" if changed else file

"""The cells of a study: every combination of scene, setting, method and swept values, resolved and checked."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.scenarios.dump import dumps, toml_text
from mjnav.scenarios.spec import Scenario
from mjnav.study.study_file import MethodEntry, Overrides, SettingEntry, StudyFile, scene_path

DEFAULT_SETTING = "default"


@dataclass(frozen=True, slots=True)
class Cell:
    """What all episodes of one row of a table share; they differ in their seed.

    `parameters` are the swept values by their full key ("control.weight"); `document` is the scenario as a run file,
    every default explicit, its seed 0.
    """

    scene: str
    setting: str
    method: str
    controller: str
    parameters: str  # JSON, keys sorted
    document: str

    @property
    def label(self) -> str:
        """The cell in a line."""
        return f"scene {self.scene}, setting {self.setting}, method {self.method}"


def resolve(study: StudyFile, overrides: Sequence[str] = (), scenes: Sequence[str] = ()) -> tuple[Cell, ...]:
    """Every cell of the study, its scenario built and its controller made once.

    `overrides` are the command line's KEY=VALUE, which come last; `scenes` take the place of the study's. Raises
    InvalidValue that names the cell, and where two cells are the same.
    """
    paths = [*scenes] or [scene_path(study, scene) for scene in study.scenes]
    names: dict[str, str] = {}
    for i, path in enumerate(paths):
        where = "--scene" if scenes else f"{study.source}: scenes.{i}"
        try:
            name = load_scenario(path).name
        except InvalidValue as error:
            raise error.within(file=error.file or where) from None
        if name in names.values():
            raise InvalidValue("", path, f"a scene of another name than {name!r}", file=where)
        names[path] = name
    cells: list[Cell] = []
    seen: dict[str, Cell] = {}
    for path, setting, swept, method in product(
        paths, study.settings or (SettingEntry(DEFAULT_SETTING),), _combinations(study, "", study.grid), study.methods
    ):
        for own in _combinations(study, method.label, _controller_keys(method.grid)):
            cell = _cell(study, path, names[path], setting, swept, method, own, overrides)
            if cell.document in seen:
                allowed = f"cells that differ; {seen[cell.document].label} is the same"
                raise InvalidValue("", cell.label, allowed, file=study.source)
            seen[cell.document] = cell
            cells.append(cell)
    return tuple(cells)


def _cell(
    study: StudyFile,
    path: str,
    scene: str,
    setting: SettingEntry,
    swept: Overrides,
    method: MethodEntry,
    own: Overrides,
    overrides: Sequence[str],
) -> Cell:
    """One combination of everything. Raises InvalidValue that names it."""
    named = [part for part in (setting.name if study.settings else "", _suffix(swept)) if part]
    setting_label = ", ".join(named) or DEFAULT_SETTING
    method_label = " ".join(part for part in (method.label, _suffix(own)) if part)
    given = {**_flat(study.set), **_flat(setting.set), **swept, **_controller_keys(method.set), **own}
    try:
        scenario = load_scenario(path, [*map(_override, given.items()), *overrides], controller=method.controller)
    except InvalidValue as error:
        if error.file == "--set" and any(text.startswith(f"{error.key}=") for text in overrides):
            raise
        where = f"{study.source}: scene {scene}, setting {setting_label}, method {method_label}"
        raise error.within(file=where) from None
    _check_repeatable(scenario, f"{study.source}: scene {scene}, setting {setting_label}")
    parameters = json.dumps({**swept, **own}, sort_keys=True, default=str)
    document = dumps(replace(scenario, seed=0, description=""))
    return Cell(scene, setting_label, method_label, scenario.control.method, parameters, document)


def _check_repeatable(scenario: Scenario, where: str) -> None:
    latency = scenario.control.latency
    if latency is not None and latency.model == "measured":
        allowed = "a latency that another machine repeats: delay, or a trace"
        raise InvalidValue("control.latency.model", latency.model, allowed, file=where)


def _combinations(study: StudyFile, method: str, grid: Overrides) -> Iterator[dict[str, object]]:
    """Every value of every key with every other. Raises InvalidValue for what is no list of distinct values."""
    lists: dict[str, list] = {}
    for key, values in _flat(grid).items():
        if not isinstance(values, list) or not values or any(value in values[:i] for i, value in enumerate(values)):
            where = f"{study.source}: method {method}" if method else study.source
            raise InvalidValue(f"grid.{key}", values, "an array of one or more values, every one once", file=where)
        lists[key] = values
    for values in product(*lists.values()):
        yield dict(zip(lists, values, strict=True))


def _flat(table: Mapping[str, object], prefix: str = "") -> dict[str, object]:
    """Values by dotted keys, from tables in one another."""
    found: dict[str, object] = {}
    for key, value in table.items():
        found |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


def _controller_keys(table: Overrides) -> dict[str, object]:
    """A key without a dot is one of [control]."""
    return {key if "." in key else f"control.{key}": value for key, value in _flat(table).items()}


def _override(item: tuple[str, object]) -> str:
    """KEY=VALUE, as `--set` takes it."""
    key, value = item
    return f"{key}={toml_text({'_': value}).strip().removeprefix('_ = ')}"


def _suffix(swept: Overrides) -> str:
    """The swept values for a label: weight=0.3 rate=20.0."""
    return " ".join(f"{key.removeprefix('control.')}={_shown(value)}" for key, value in swept.items())


def _shown(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)

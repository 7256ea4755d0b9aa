"""The cells of a study: every combination of scene, setting, method and swept values, resolved and checked."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario, resolved_parameters
from mjnav.scenarios.dump import dumps, toml_text
from mjnav.scenarios.spec import Scenario
from mjnav.study.study_file import StudyFile, scene_path
from mjnav.study.variants import Variant, flat, variants


@dataclass(frozen=True, slots=True)
class Cell:
    """What all episodes of one row of a table share; they differ in their seed.

    `parameters` are the swept values by their full key ("control.weight"); `document` is the scenario as a run file,
    every default but the controller's explicit, its seed 0; `control` are the controller's parameters, every default
    among them.
    """

    scene: str
    setting: str
    method: str
    controller: str
    parameters: str  # JSON, keys sorted
    document: str
    control: str = "{}"  # JSON, keys sorted

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
    for variant in variants(study, paths):
        cell = _cell(study, variant, names[variant.scene], overrides)
        if cell.document in seen:
            allowed = f"cells that differ; {seen[cell.document].label} is the same"
            raise InvalidValue("", cell.label, allowed, file=study.source)
        seen[cell.document] = cell
        cells.append(cell)
    return tuple(cells)


def _cell(study: StudyFile, variant: Variant, scene: str, overrides: Sequence[str]) -> Cell:
    """One combination of everything. Raises InvalidValue that names it."""
    setting, method = variant.labels
    given = [*map(_override, {**flat(study.set), **variant.overrides}.items()), *overrides]
    try:
        scenario = load_scenario(variant.scene, given, controller=variant.method.controller)
    except InvalidValue as error:
        if error.file == "--set" and any(text.startswith(f"{error.key}=") for text in overrides):
            raise
        where = f"{study.source}: scene {scene}, setting {setting}, method {method}"
        raise error.within(file=where) from None
    _check_repeatable(scenario, f"{study.source}: scene {scene}, setting {setting}")
    parameters = json.dumps({**variant.swept, **variant.own}, sort_keys=True, default=str)
    document = dumps(replace(scenario, seed=0, description=""))
    control = json.dumps(resolved_parameters(scenario), sort_keys=True)
    return Cell(scene, setting, method, scenario.control.method, parameters, document, control)


def _check_repeatable(scenario: Scenario, where: str) -> None:
    latency = scenario.control.latency
    if latency is not None and latency.model == "measured":
        allowed = "a latency that another machine repeats: delay, or a trace"
        raise InvalidValue("control.latency.model", latency.model, allowed, file=where)


def _override(item: tuple[str, object]) -> str:
    """KEY=VALUE, as `--set` takes it."""
    key, value = item
    return f"{key}={toml_text({'_': value}).strip().removeprefix('_ = ')}"

"""The cells of a study: every combination of scene, setting, method and swept values, resolved and checked."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import chdir
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.robot.controller import resolved_parameters
from mjnav.scene import dumps
from mjnav.scene.overrides import Override, overrides_of
from mjnav.settings import below
from mjnav.settings.plugins import placed
from mjnav.study.study_file import MethodEntry, Overrides, SettingEntry, StudyFile, controller_keys, flat, scene_paths

DEFAULT_SETTING = "default"
METHOD = "control.method"  # no value of a study has this key: its methods name their controllers


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination, of which nothing is built yet."""

    scene: str  # as it was given
    setting: SettingEntry | None  # None in a study without settings
    swept: Overrides  # a value of every key of the study's grid
    method: MethodEntry
    own: Overrides  # a value of every key of the method's grid or search; none for the first setting of a search
    number: int | None = None  # of the setting in a search, from 1 on

    @property
    def names(self) -> tuple[str, str]:
        """Of the setting and of the method, with the swept values or the number in a search."""
        return self._with_values(self.setting.name if self.setting else "", self.method.identifier)

    @property
    def shown(self) -> tuple[str, str]:
        """The same with the labels of both, as people read them."""
        return self._with_values(self.setting.shown if self.setting else "", self.method.shown)

    def _with_values(self, setting: str, method: str) -> tuple[str, str]:
        setting = ", ".join(part for part in (setting, _suffix(self.swept)) if part)
        own = _suffix(self.own) if self.number is None else f"#{self.number}"
        return setting or DEFAULT_SETTING, " ".join(part for part in (method, own) if part)

    @property
    def overrides(self) -> dict[str, object]:
        """All values by full key, without those of the study's [set]."""
        setting = self.setting.set if self.setting else {}
        return {**flat(setting), **self.swept, **self.method.values, **self.own}


@dataclass(frozen=True, slots=True)
class Cell:
    """What the episodes of a cell share; they differ in their seed.

    `parameters` are the swept values by their full key ("control.weight"); `document` is the scenario as a run file
    with seed 0 and every default except the controller's; `control` are all parameters of the controller.
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


def variants(study: StudyFile, scenes: Sequence[str]) -> Iterator[Variant]:
    """Every combination in these scenes; methods and their grids or searches run fastest.

    Raises InvalidValue where a grid has no list of distinct values, or a search draws what its method does not take.
    """
    combinations = _combinations(study, "", study.grid)
    own_of = {method.identifier: list(_own(study, method)) for method in study.methods}
    for scene, setting, swept, method in product(scenes, study.settings or (None,), combinations, study.methods):
        for number, own in own_of[method.identifier]:
            yield Variant(scene, setting, swept, method, own, number)


@dataclass(frozen=True, slots=True)
class Labels:
    """What people read in the place of the names of settings and methods; what is not here is shown by its name."""

    settings: Mapping[str, str] = field(default_factory=dict)
    methods: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, study: StudyFile | None) -> "Labels":
        """Of every setting and method of a study, but for those that would be shown alike: they keep their names."""
        pairs = [zip(v.names, v.shown, strict=True) for v in variants(study, ["any"])] if study is not None else []
        settings, methods = (dict(some) for some in zip(*pairs, strict=True)) if pairs else ({}, {})
        return cls(_distinct(settings), _distinct(methods))

    def place(self, place: tuple[str, str, str]) -> tuple[str, str, str]:
        """A scene, setting and method as they are shown."""
        scene, setting, method = place
        return scene, self.settings.get(setting, setting), self.methods.get(method, method)


def _distinct(shown: Mapping[str, str]) -> dict[str, str]:
    counts = Counter(shown.values())
    return {name: text if counts[text] == 1 else name for name, text in shown.items()}


def resolve(study: StudyFile, overrides: Sequence[str | Override] = (), scenes: Sequence[str] = ()) -> tuple[Cell, ...]:
    """Every cell of the study, its scenario built and its controller made once.

    `overrides` are the command line's KEY=VALUE, applied last; `scenes` replace the study's. Raises InvalidValue that
    names the cell, also where two cells are the same or have the same names.
    """
    paths = [*scenes] or scene_paths(study)
    names: dict[str, str] = {}
    for i, path in enumerate(paths):
        where = "scenes" if scenes else f"{study.source}: scenes.{i}"
        try:
            name = load_scenario(path).name
        except InvalidValue as error:
            raise error.within(file=error.file or where) from None
        if name in names.values():
            raise InvalidValue("", path, f"a scene of another name than {name!r}", file=where)
        names[path] = name
    cells: dict[str, Cell] = {}  # by document
    places = set[tuple[str, str, str]]()
    folder = Path(study.source).parent.absolute()
    with chdir("."):  # a controller may change the working folder when it is imported or made
        for variant in variants(study, paths):
            cell = _cell(study, variant, names[variant.scene], overrides, folder)
            if cell.document in cells:
                allowed = f"cells that differ; {cells[cell.document].label} is the same"
                raise InvalidValue("", cell.label, allowed, file=study.source)
            place = cell.scene, cell.setting, cell.method
            if place in places:
                raise InvalidValue("", cell.label, "names that differ; another cell has the same", file=study.source)
            places.add(place)
            cells[cell.document] = cell
    return tuple(cells.values())


def _cell(study: StudyFile, variant: Variant, scene: str, overrides: Sequence[str | Override], folder: Path) -> Cell:
    setting, method = variant.names
    where = f"{study.source}: scene {scene}, setting {setting}"
    own = placed({**flat(study.set), **variant.overrides}, folder)
    given = [*(Override(key, value, where) for key, value in own.items()), *overrides]
    values = flat({one.key: one.value for one in overrides_of(given)})
    if METHOD in values:
        allowed = f"values of other keys; {variant.method.controller!r} is the controller of method {method}"
        raise InvalidValue(METHOD, values[METHOD], allowed, file=where)
    controller = placed(variant.method.controller, folder)
    try:
        scenario = load_scenario(variant.scene, given, controller=controller)
    except InvalidValue as error:
        if error.file == "overrides":
            raise
        raise error.within(file=f"{where}, method {method}") from None
    latency = scenario.control.latency
    if latency is not None and latency.model == "measured":
        allowed = "a latency that another machine repeats: delay, or a trace"
        raise InvalidValue("control.latency.model", latency.model, allowed, file=where)
    parameters = json.dumps({**variant.swept, **variant.own}, sort_keys=True, default=str)
    document = dumps(replace(scenario, seed=0, description=""), draft=True)
    control = json.dumps(resolved_parameters(scenario), sort_keys=True)
    return Cell(scene, setting, method, scenario.control.method, parameters, document, control)


def _own(study: StudyFile, method: MethodEntry) -> Iterator[tuple[int | None, dict[str, object]]]:
    """The values of a method's grid, or the settings of its search with their numbers. Raises InvalidValue."""
    if method.search is None:
        yield from ((None, own) for own in _combinations(study, method.identifier, controller_keys(method.grid)))
        return
    standing = {**flat(study.set), **method.values}
    with below("search", file=f"{study.source}: method {method.identifier}"):
        yield from enumerate(method.search.settings(study.name, method.identifier, method.controller, standing), 1)


def _combinations(study: StudyFile, method: str, grid: Overrides) -> Iterator[dict[str, object]]:
    """Every value of every key with every other. Raises InvalidValue for what is no list of distinct values."""
    lists: dict[str, list] = {}
    for key, values in flat(grid).items():
        if not isinstance(values, list) or not values or any(value in values[:i] for i, value in enumerate(values)):
            where = f"{study.source}: method {method}" if method else study.source
            raise InvalidValue(f"grid.{key}", values, "an array of one or more values, every one once", file=where)
        lists[key] = values
    for values in product(*lists.values()):
        yield dict(zip(lists, values, strict=True))


def _suffix(swept: Overrides) -> str:
    """The swept values for a label: weight=0.3 rate=20.0."""
    return " ".join(f"{key.removeprefix('control.')}={_value_text(value)}" for key, value in swept.items())


def _value_text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)

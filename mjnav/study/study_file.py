"""A study file: which scenes, methods, settings and seeds are run against one another.

    schema = 1
    name = "noise"                              # its results go to runs/out/noise/
    description = "One line that `mjnav list` prints."
    scenes = ["crossing1", "mine/corner.toml"]  # shipped names, or paths from this file's folder
    seeds = { first = 0, count = 200 }          # or a list; the same for every cell
    [set]                                       # any keys of a run file, for all episodes
    physics.engine = "kinematic"
    [grid]                                      # lists of values, every one with every other
    control.rate = [10.0, 20.0]
    [[settings]]                                # optional: variants of the world, by name
    name = "skewed"
    set = { noise.profile = "pearson" }
    [[methods]]
    controller = "rkhs"
    name = "rkhs d=1"                           # the controller's name by default
    label = "RKHS, degree 1"                    # optional: what tables and charts call it
    set = { degree = 1 }                        # a key without a dot is the controller's, others are a run file's
    grid = { weight = [0.3, 1, 3] }
    [[methods]]
    controller = "saa"                          # in place of a grid, settings that are drawn: "saa #1" to "saa #24"
    search = { count = 24, eta = { low = 0.8, high = 0.99 }, safety_margin = { one_of = [0.0, 0.05] } }

The cells are scenes x settings x grid x methods x their grids or searches; an episode is a cell under a seed. Keys
that are given more than once: the method's grid or search comes last, before it the method's set, the grid,
the setting, [set], the scene. A method starts with its own default parameters, as `--controller` does.

A search draws settings of a method, as many for one method as for another:

    search = { count = 24, weight = { low = 1.0, high = 30.0, log = true }, degree = { one_of = [1, 2, 3] } }

A value that is drawn stands as in a random scene (`mjnav.scene.draws`). Of a parameter that is a whole number,
whole numbers are drawn; of a method of one's own, and of other keys of a run file, where the ends are whole numbers.
"""

import operator
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf
from pathlib import Path
from typing import Annotated, Any

from mjnav.control.registry import shipped_parameters
from mjnav.errors import InvalidValue, unknown_name
from mjnav.output_files import path_text
from mjnav.rng import stream
from mjnav.scene.draws import Draw, drawing, is_draw, kind_of
from mjnav.scene.library import data_folder, describe
from mjnav.scene.load import read_text
from mjnav.scene.ranges import MAX_SEED, Seed
from mjnav.scene.spec import Control
from mjnav.scene.toml import parse, toml_text
from mjnav.settings import Beside, Length, Range, Settled, Text, below, keys, read_document, tables

Overrides = Mapping[str, object]  # as tables in one another, or by dotted keys

# --------------------------------------------------------------------------------------------- search


MAX_COUNT = 10_000
MAX_REDRAWS = 10_000  # of a setting, until it is none of those before
_DIGITS = 3  # significant ones of a drawn number: a setting can be typed in
_PERIOD = 1.0 / Control().rate  # [s] of the default parameters


@dataclass(frozen=True, slots=True)
class Search(Settled):
    """Settings of a method: its parameters as they stand, then drawn ones."""

    count: Annotated[int, Range(1, MAX_COUNT), "number of settings; the first has the parameters as they stand"]
    seed: Annotated[Seed | None, "of the draws; by default they follow from the study's name"] = None
    ranges: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    def _check(self):
        for key, value in _by_key(self.ranges).items():
            with below(key.removeprefix("control.")):
                if not is_draw(value):
                    raise InvalidValue("", value, "{ low, high }, also with log = true; { mean, std }; { one_of }")
                drawing(Any, value)

    def settings(
        self, study: str, label: str, controller: str, standing: Mapping[str, object]
    ) -> list[dict[str, object]]:
        """The values of every setting by full key, "control.weight"; none for the first.

        `study` and `label` name the study and the method, whose values in `standing` (by full key) are the first
        setting. Every key draws from a stream of its own, one setting after the other: with a larger count, and with
        other methods, the settings stay, and so do a parameter's values beside one that is added. Numbers have three
        significant digits; a setting that came before is drawn again. Raises InvalidValue for a parameter that a
        shipped method does not have, a range with values that it does not allow, and a count that the values of
        `one_of` cannot fill.
        """
        values = _by_key(self.ranges)
        defaults = shipped_parameters(controller, _PERIOD)
        hints = {key: _hint(key, defaults) for key in values}
        draws: dict[str, Draw] = {}
        for key, value in values.items():
            with below(key.removeprefix("control.")):
                draws[key] = drawing(hints[key], value)
        streams = self._streams(study, label)
        known = {f"control.{key}": getattr(defaults, key) for key in keys(type(defaults))} if defaults else {}
        first: dict[str, object] = {key: {**known, **standing}.get(key) for key in values}
        found, redraws = [first], 0
        while len(found) < self.count and redraws < MAX_REDRAWS:
            drawn = {key: _rounded(one, draws[key](key, streams)) for key, one in values.items()}
            redraws = redraws + 1 if drawn in found else 0
            if not redraws:
                found.append(drawn)
        if len(found) < self.count:
            raise InvalidValue("count", self.count, f"at most {len(found)}: its values make no more settings")
        return [{}, *found[1:]]

    def _streams(self, study: str, label: str) -> Callable[[str], Any]:
        body = label if self.seed is not None else f"{study}/{label}"
        return cache(lambda key: stream(self.seed or 0, f"search.{key}", body))


def _by_key(table: Overrides) -> dict[str, object]:
    """What is drawn by full key."""
    return controller_keys(table, ends=lambda value: not value or kind_of(value) is not None)


def controller_keys(table: Overrides, *, ends: Callable[[Any], bool] = operator.not_) -> dict[str, object]:
    """Values by full key, as `flat` gives them; a key without a dot is one of [control]."""
    return {key if "." in key else f"control.{key}": value for key, value in flat(table, ends=ends).items()}


def flat(table: Overrides, *, dot: str = ".", ends: Callable[[Any], bool] = operator.not_) -> dict[str, Any]:
    """Values by dotted keys, from nested tables; a table at which it `ends` is a value, as one with nothing in it."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and not ends(value):
            found |= {f"{key}{dot}{part}": inner for part, inner in flat(value, dot=dot, ends=ends).items()}
        else:
            found[key] = value
    return found


def _hint(key: str, defaults: Any) -> Any:
    """The type of a key's values; Any where it is no shipped method's parameter. Raises InvalidValue."""
    group, _, name = key.partition(".")
    if defaults is None or group != "control" or "." in name:
        return Any
    known = {**keys(Control), **keys(type(defaults))}
    if name not in known:
        raise unknown_name(name, name, keys(type(defaults)))
    return known[name].hint


def _rounded(draw: Any, value: Any) -> Any:
    """A drawn number with three significant digits, between the ends of its range; one of a list as it stands."""
    if isinstance(draw, list):
        return [_rounded(one, item) for one, item in zip(draw, value, strict=True)]
    if not isinstance(value, float) or not isinstance(draw, Mapping) or "one_of" in draw:
        return value
    return min(max(float(f"{value:.{_DIGITS}g}"), draw.get("low", -inf)), draw.get("high", inf))


# ----------------------------------------------------------------------------------------- study file


FOLDER = "studies"  # below runs/
MAX_SEEDS = 10_000_000
MAX_CELLS = 10_000  # of scenes, settings and methods each
MAX_NAME = 200  # [bytes] that any file system takes, with what is added to it


@dataclass(frozen=True, slots=True)
class SeedRange(Settled):
    """`count` seeds from `first` on."""

    count: Annotated[int, Range(1, MAX_SEEDS), "number of seeds"]
    first: Annotated[Seed, "the others follow it"] = 0

    def _check(self):
        Range(0, MAX_SEED - self.count + 1).check("first", self.first)


@dataclass(frozen=True, slots=True)
class MethodEntry(Settled):
    """A controller with parameters of its own, under a name of its own."""

    controller: Annotated[str, "a name that `mjnav list` prints, package.module:Class or file.py:Class"]
    name: Annotated[str, "in the rows of results; the controller's by default"] = ""
    set: Annotated[Overrides, "a key without a dot is the controller's, others are a run file's"] = field(
        default_factory=dict
    )
    grid: Annotated[Overrides, "the same keys, with arrays of values"] = field(default_factory=dict)
    search: Annotated[
        Search | None,
        "in place of a grid: settings that are drawn. Beside `count` the same keys, each with { low, high }, also with "
        "log = true, { mean, std } or { one_of }",
    ] = None
    label: Annotated[str, "in tables; by default the name, of file.py:Class the class"] = ""

    def _check(self):
        if self.grid and self.search is not None:
            raise InvalidValue("search", "a search beside a grid", "one of the two")

    @property
    def values(self) -> dict[str, object]:
        """What `set` says, by full key."""
        return controller_keys(self.set)

    @property
    def identifier(self) -> str:
        """The name, or else the controller's."""
        return self.name or self.controller

    @property
    def shown(self) -> str:
        """What people read: the label, the name, or else the controller's, of one's own controller its class."""
        return self.label or self.name or self.controller.rpartition(":")[2]


@dataclass(frozen=True, slots=True)
class SettingEntry(Settled):
    """A variant of the world."""

    name: Annotated[str, "in the rows of results"]
    set: Annotated[Overrides, "keys of a run file"] = field(default_factory=dict)
    label: Annotated[str, "in tables; the name by default"] = ""

    def _check(self):
        if not self.name:
            raise InvalidValue("name", self.name, "a name")

    @property
    def shown(self) -> str:
        """What people read: the label, or else the name."""
        return self.label or self.name


@dataclass(frozen=True, slots=True)
class StudyFile(Settled):
    """A study file as it stands; `cells.resolve` says what it asks for."""

    schema: Annotated[int, Range(1, 1), "version of this format"]
    name: Annotated[
        str,
        Text(
            r"[^/.][^/]*",
            100,
            'up to 100 printable characters without "/", no dot in front: a folder is named after it',
        ),
        "of the study, and of the folder of its results",
    ]
    scenes: Annotated[tuple[str, ...], Length(1, MAX_CELLS), "shipped names, or paths from this file's folder"]
    methods: Annotated[tuple[MethodEntry, ...], Length(1, MAX_CELLS)]
    seeds: Annotated[SeedRange | Annotated[tuple[Seed, ...], Length(1, MAX_SEEDS)], "the same for every cell"] = (
        SeedRange(100)
    )
    description: Annotated[str, "one line that `mjnav list` prints"] = ""
    set: Annotated[Overrides, "any keys of a run file, for all episodes"] = field(default_factory=dict)
    grid: Annotated[Overrides, "the same keys, with arrays of values, every one with every other"] = field(
        default_factory=dict
    )
    settings: Annotated[tuple[SettingEntry, ...], Length(0, MAX_CELLS), "variants of the world"] = ()
    detour: Annotated[bool, "also run the people of every episode without the robot: the figures detour_*"] = False
    source: str = field(default="", compare=False)  # the file it came from

    def _check(self):
        if len(self.name.encode()) > MAX_NAME:
            raise InvalidValue("name", self.name, f"at most {MAX_NAME} bytes in UTF-8: a folder is named after it")
        _check_distinct("scenes", self.scenes)
        _check_distinct("methods", [method.identifier for method in self.methods])
        _check_distinct("settings", [setting.name for setting in self.settings])
        if not isinstance(self.seeds, SeedRange):
            _check_distinct("seeds", self.seeds)

    @property
    def all_seeds(self) -> range | tuple[int, ...]:
        """Every seed."""
        if isinstance(self.seeds, SeedRange):
            return range(self.seeds.first, self.seeds.first + self.seeds.count)
        return self.seeds

    def with_seeds(self, count: int) -> "StudyFile":
        """The same study with `count` seeds from its first on. Raises InvalidValue."""
        try:
            return replace(self, seeds=SeedRange(count, self.all_seeds[0]))
        except InvalidValue as error:
            raise InvalidValue("", error.found, error.allowed, file="seeds") from None


def load_study(name_or_path: str | os.PathLike[str]) -> StudyFile:
    """The study of a shipped name, or of a path where there is a "/" or ".toml" at the end. Raises InvalidValue."""
    name = path_text("study", name_or_path, "a shipped study by name, or the path of a study file")
    if isinstance(name_or_path, str) and "/" not in name and not name.endswith(".toml"):
        path = data_folder("runs") / FOLDER / f"{name}.toml"
        if not os.path.isfile(path):
            raise unknown_name("study", name, studies(), also="the path of a study file, .toml")
        name = str(path)
    document = parse(read_text(name), name)
    with below(file=name):
        return replace(read_document(StudyFile, document), source=name)


def study_text(study: StudyFile) -> str:
    """The text of the file that a study came from; of a study that was made in Python, all of its values."""
    return read_text(study.source) if study.source else toml_text(tables(study))


def studies() -> dict[str, str]:
    """The description of every shipped study, by name."""
    return dict(describe(FOLDER))


def shipped_scenes(scenes: Iterable[str]) -> list[str]:
    """The scenes that are named; not those that are given by path."""
    return [scene for scene in scenes if "/" not in scene and not scene.endswith(".toml")]


def scene_paths(study: StudyFile) -> list[str]:
    """Every scene as `load_scenario` takes it: a relative path counts from the study file's folder."""
    shipped, folder = shipped_scenes(study.scenes), Path(study.source).parent
    return [scene if scene in shipped else os.path.join(folder, Path(scene)) for scene in study.scenes]


def _check_distinct(key: str, values: Sequence[object]) -> None:
    seen = set[object]()
    for i, value in enumerate(values):
        if value in seen:
            raise InvalidValue(f"{key}.{i}", value, "every one once")
        seen.add(value)

"""What a study file asks for: scenes x settings x its grid x methods x their grids, and what these are called."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from mjnav.errors import InvalidValue
from mjnav.study.study_file import MethodEntry, Overrides, SettingEntry, StudyFile

DEFAULT_SETTING = "default"


@dataclass(frozen=True, slots=True)
class Variant:
    """One of them, nothing of it built yet."""

    scene: str  # as it was given
    setting: SettingEntry | None  # None in a study without settings
    swept: Overrides  # a value of every key of the study's grid
    method: MethodEntry
    own: Overrides  # the same of the method's grid

    @property
    def labels(self) -> tuple[str, str]:
        """Of the setting and of the method, with the swept values."""
        setting = ", ".join(part for part in (self.setting.name if self.setting else "", _suffix(self.swept)) if part)
        method = " ".join(part for part in (self.method.label, _suffix(self.own)) if part)
        return setting or DEFAULT_SETTING, method

    @property
    def overrides(self) -> dict[str, object]:
        """All values by full key, the study's own [set] apart."""
        setting = self.setting.set if self.setting else {}
        return {**flat(setting), **self.swept, **_controller_keys(self.method.set), **self.own}


def variants(study: StudyFile, scenes: Sequence[str]) -> Iterator[Variant]:
    """In these scenes, methods and their grids running fastest. Raises InvalidValue for a grid that is none."""
    combinations = _combinations(study, "", study.grid)
    for scene, setting, swept, method in product(scenes, study.settings or (None,), combinations, study.methods):
        for own in _combinations(study, method.label, _controller_keys(method.grid)):
            yield Variant(scene, setting, swept, method, own)


def _controller_keys(table: Overrides) -> dict[str, object]:
    """A key without a dot is one of [control]."""
    return {key if "." in key else f"control.{key}": value for key, value in flat(table).items()}


def flat(table: Mapping[str, object], prefix: str = "") -> dict[str, object]:
    """Values by dotted keys, from tables in one another."""
    found: dict[str, object] = {}
    for key, value in table.items():
        found |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


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
    return " ".join(f"{key.removeprefix('control.')}={_shown(value)}" for key, value in swept.items())


def _shown(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)

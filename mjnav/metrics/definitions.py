"""What a figure is: its name, unit, definition and source, written once beside the function that computes it.

    @figures("path", Definition("path_length_m", better=LOWER))
    def path_length(trajectory: Trajectory) -> float:

What it is, in words, stands in the function's docstring, in a list: "* path_length_m: length of the driven path". What
all figures of a function have in common is said once, behind them. The summary, the columns of a sweep, tables, pages
and the documentation are made from these definitions.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, replace
from functools import update_wrapper
from inspect import cleandoc, signature
from types import MappingProxyType
from typing import Any, Generic, ParamSpec, TypeVar

Parameters = ParamSpec("Parameters")
Found = TypeVar("Found")

STRING, INTEGER, NUMBER, TRUTH = "string", "int64", "double", "bool"  # as Arrow calls them
LOWER, HIGHER = "lower", "higher"
TABLE_1 = "Francis et al. (2023), table 1"
HUNAVSIM = "Perez-Higueras et al. (2023)"
NOBODY = "no people"
_UNITS: Mapping[str, str] = MappingProxyType(
    {"m": "m", "s": "s", "ms": "ms", "rad": "rad", "m_s": "m/s", "m_s2": "m/s²", "m_s3": "m/s³"}
)
_ENTRY = re.compile(r"^\* (\S+): (.+(?:\n  .+)*)", re.MULTILINE)
_UNIT = re.compile(rf"_({'|'.join(sorted(_UNITS, key=len, reverse=True))})(?=\.|$)")


@dataclass(frozen=True, slots=True)
class Definition:
    """One figure. `equation` is LaTeX, in the symbols of docs/method/figures.md."""

    name: str  # its key in `mjnav run --json`, behind that of its table and a dot where it is in one
    text: str = ""  # what it is, in a line; of a function's figure, from the function's docstring
    _: KW_ONLY
    type: str = NUMBER
    unit: str = ""  # "" of a plain number, a truth or a text; else it is taken from the end of the name
    better: str = ""  # LOWER or HIGHER; "" of what is neither good nor bad
    words: str = ""  # what tables and charts call it; made from its name where empty
    equation: str = ""
    null: str = ""  # when it is null although the episode has a result
    source: str = ""  # author (year)
    over_all: bool = False  # its mean is over all episodes, not only over those that succeeded
    group: str = ""  # that of its function where empty

    def __post_init__(self):
        ending = _UNIT.search(self.name)
        object.__setattr__(self, "unit", self.unit or (_UNITS[ending[1]] if ending else ""))
        object.__setattr__(self, "words", self.words or _UNIT.sub("", self.column).replace("_", " "))

    @property
    def column(self) -> str:
        """Its name in the rows of a sweep, and in options: "collisions_person"."""
        return self.name.replace(".", "_")

    @property
    def about(self) -> str:
        """The definition with when it is null, what is better and the source, in a line."""
        tail = [f"null: {self.null}"] * bool(self.null) + [f"{self.better} is better"] * bool(self.better)
        tail += [self.source] * bool(self.source)
        return self.text + (f" ({'; '.join(tail)})" if tail else "")

    @property
    def line(self) -> str:
        """The same behind the unit."""
        return f"[{self.unit}] {self.about}" if self.unit else self.about


class FigureFunction(Generic[Parameters, Found]):
    """A function with the definitions of the figures that it returns: one value, or a tuple with one for each.

    None stands for figures that are all undefined. What it takes of a run, it takes by the names of its parameters.
    """

    def __init__(self, function: Callable[Parameters, Found], definitions: tuple[Definition, ...]):
        self._function, self.definitions = function, definitions
        self._takes = tuple(signature(function).parameters)
        update_wrapper(self, function)

    def __call__(self, *arguments: Parameters.args, **named: Parameters.kwargs) -> Found:
        """What the function returns."""
        return self._function(*arguments, **named)

    def of_run(self, **run: Any) -> dict[str, Any]:
        """Its figures by name, of a run's `trajectory`, `scenario` and `outcome`."""
        function: Callable[..., Any] = self._function
        value = function(**{name: run[name] for name in self._takes})
        names = [definition.name for definition in self.definitions]
        if value is None:
            return dict.fromkeys(names)
        return dict(zip(names, value if len(names) > 1 else (value,), strict=True))


def figures(
    group: str, *definitions: Definition, **shared: Any
) -> Callable[[Callable[Parameters, Found]], FigureFunction[Parameters, Found]]:
    """Decorates a function with the definitions of what it computes; `shared` are fields that all of them have.

    `group` is the one that `mjnav compare --figure` takes. What a definition does not say itself stands in the
    docstring of the function: "* NAME: what it is".
    """

    def decorated(function: Callable[Parameters, Found]) -> FigureFunction[Parameters, Found]:
        entries = _ENTRY.findall(cleandoc(function.__doc__ or ""))
        texts = {name: " ".join(text.split()) for name, text in entries}
        return FigureFunction(
            function,
            tuple(
                replace(one, text=one.text or texts.get(one.name, ""), group=one.group or group, **shared)
                for one in definitions
            ),
        )

    return decorated

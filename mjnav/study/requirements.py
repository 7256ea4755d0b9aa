"""Requirements on figures, for a user's own CI: "success>=0.95", or for some cells "hall/rkhs: success>=0.95".

    [WHERE:] FIGURE OPERATOR VALUE        operators: >= <= > < ==

A requirement is on the value itself, in a table on the point estimate: intervals do not count. A figure that is
undefined (null) meets no requirement. True is 1 and false is 0. WHERE is a scene, a setting, a method or several of
them in this order with slashes between; * stands for any text.

Requirements may be about the figures of a run, of each cell of a table, or of a cell before and after.
"""

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from itertools import combinations
from math import isfinite
from types import MappingProxyType

from mjnav.errors import InputError, InvalidValue, unknown_name
from mjnav.loop.result import RunSummary
from mjnav.metrics.summary import OF_RUNS
from mjnav.metrics.timing import compute_ms
from mjnav.study.compare.before_after import KINDS, BeforeAfter
from mjnav.study.compare.cell_rows import CellPlace, is_cost, numbers
from mjnav.study.compare.study_comparison import MethodRow, StudyComparison
from mjnav.study.store import FIGURES, is_own

# --------------------------------------------------------------------------------------- requirements


OPTION = "--require"
ALLOWED = (
    'FIGURE>=VALUE, as in "success>=0.95"; also <=, >, < and ==; in front, for some cells of a table, "hall/rkhs: "'
)

Value = float | str | None

_OPERATORS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt, "==": operator.eq}
)
_FORM = re.compile(r"(?:(?P<where>.+):)?\s*(?P<figure>\w+)\s*(?P<operator>>=|<=|==|>|<)\s*(?P<value>[^<>=\s]+)\s*")
_WORDS = MappingProxyType({"true": 1.0, "false": 0.0})


@dataclass(frozen=True, slots=True)
class Requirement:
    """One requirement, as it was given and in parts."""

    text: str
    where: str  # "" for all cells
    figure: str
    operator: str
    value: float | str

    @classmethod
    def parse(cls, text: str) -> "Requirement":
        """The requirement that a text states. Raises InvalidValue."""
        parts = _FORM.fullmatch(text.strip())
        if parts is None:
            raise InvalidValue("", text, ALLOWED, file=OPTION)
        word = parts["value"]
        value: float | str = word
        with suppress(ValueError):
            value = _WORDS[word] if word in _WORDS else float(word)
        if isinstance(value, str) and parts["operator"] != "==":
            raise InvalidValue(parts["figure"], word, f"a number behind {parts['operator']}", file=OPTION)
        if isinstance(value, float) and not isfinite(value):
            raise InvalidValue(parts["figure"], word, "a finite number", file=OPTION)
        return cls(text, (parts["where"] or "").strip(), parts["figure"], parts["operator"], value)

    def met_by(self, figure: Value) -> bool:
        """Whether a figure of this value meets it."""
        if isinstance(figure, str) or isinstance(self.value, str):
            return figure == self.value
        return figure is not None and _OPERATORS[self.operator](figure, self.value)

    def covers(self, cell: Sequence[str]) -> bool:
        """Whether it is about the cell of these labels: scene, setting and method."""
        names = ["/".join(part) for num in (1, 2, 3) for part in combinations(cell, num)]
        return not self.where or any(self.where == name or fnmatchcase(name, self.where) for name in names)


@dataclass(frozen=True, slots=True)
class Answer:
    """What one requirement found in one run or cell."""

    requirement: Requirement
    found: Value
    cell: CellPlace | None = None  # None of a run

    @property
    def met(self) -> bool:
        """Whether the requirement is met."""
        return self.requirement.met_by(self.found)

    def __str__(self) -> str:
        asked = f"{self.requirement.figure} {self.requirement.operator} {_text(self.requirement.value)}"
        where = f"{', '.join(self.cell)}: " if self.cell is not None else ""
        return f"required {where}{asked}; found {_text(self.found)}"

    def document(self) -> dict[str, object]:
        """An element of the list `requirements` of --json."""
        labels = {} if self.cell is None else dict(zip(("scene", "setting", "method"), self.cell, strict=True))
        return {"requirement": self.requirement.text, **labels, "found": self.found, "met": self.met}


def of_run(requirements: Iterable[Requirement], figures: Mapping[str, object]) -> list[Answer]:
    """What the requirements find among the figures of a run. Raises InvalidValue for a figure that is not there."""
    return [Answer(each, _value(figures[check_figure(each, figures)])) for each in requirements]


def of_cells(requirements: Iterable[Requirement], cells: "Cells") -> list[Answer]:
    """What the requirements find in the cells of a table, each cell's figures by name.

    Raises InvalidValue for a figure that is not there, InputError for a requirement on no cell.
    """
    answers = []
    for each in requirements:
        covered = [cell for cell in cells if each.covers(cell)]
        if not covered:
            named = "; ".join("/".join(cell) for cell in list(cells)[:5])
            raise InputError(f"{OPTION} {each.text}: no cell is {each.where!r}; there are {named}")
        for cell in covered:
            if each.figure not in cells[cell]:
                raise unknown_name(OPTION, each.figure, [*cells[cell], *numbers()])
            answers.append(Answer(each, _value(cells[cell][each.figure]), cell))
    return answers


def run_figures() -> list[str]:
    """The figures of any run: its summary's keys, those of inner tables joined by "_" as in the rows of a sweep."""
    figures = [one.column for function in (*OF_RUNS, compute_ms) for one in function.definitions]
    return [*figures, *(field.name for field in fields(RunSummary) if field.name in FIGURES)]


def check_figure(requirement: Requirement, names: Iterable[str]) -> str:
    """The figure of a requirement, which is one of `names`. Raises InvalidValue."""
    names = list(names)
    if requirement.figure not in names:
        raise unknown_name(OPTION, requirement.figure, names)
    return requirement.figure


def _value(figure: object) -> Value:
    if figure is None or isinstance(figure, str):
        return figure
    value = float(figure)  # type: ignore[arg-type]
    return value if isfinite(value) else None


def _text(value: Value) -> str:
    return "null" if value is None else value if isinstance(value, str) else f"{value:.6g}"


# ----------------------------------------------------------------------------------- figures of cells


WIN_SHARE = "win_share"  # of the pairs that are no ties, against the reference
RATIO = "_ratio"  # end of the name of a ratio of costs to the reference: time_s_ratio
CHANGE = "_change"  # end of the name of a paired difference: success_change

Cells = Mapping[CellPlace, Mapping[str, object]]


def figures_for(required: Iterable[Requirement]) -> list[str]:
    """The columns that a table needs for these requirements; unknown names are left to `of_cells`."""
    known = numbers()
    names = [r.figure if r.figure in known else r.figure.removesuffix(CHANGE).removesuffix(RATIO) for r in required]
    return [name for name in names if name in known or is_own(name)]


def of_study(results: StudyComparison) -> Cells:
    """The point estimates of every cell, and how many episodes it has."""
    return {
        (table.scene, table.setting, row.method): _figures(row)
        | {"episodes": row.num, "failed": row.num_failed, "missing": row.num_missing}
        for table, row in results.rows
    }


def of_before_after(results: BeforeAfter) -> Cells:
    """The point estimates after, the paired differences, and how many pairs changed in which way."""
    return {
        cell.place: _figures(cell.after)
        | {"pairs": cell.pairs, "identical": cell.identical}
        | {kind: len(cell.seeds_of(kind)) for kind in KINDS}
        for cell in results.cells
    }


def _figures(row: MethodRow) -> dict[str, object]:
    """The figures of a row, its differences from the reference, and of every cost the ratio; None where undefined."""
    figures: dict[str, object] = {name: estimate.value for name, estimate in row.figures.items()}
    figures |= {**row.plain, WIN_SHARE: None if row.wins is None else row.wins.share}
    for name in row.figures:
        change = row.differences.get(name)
        figures[f"{name}{CHANGE}"] = None if change is None else change.estimate.value
        if is_cost(name):
            figures[f"{name}{RATIO}"] = None if change is None or change.ratio is None else change.ratio.value
    return figures

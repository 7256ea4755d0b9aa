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
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from math import isfinite
from types import MappingProxyType

from mjnav.errors import InputError, InvalidValue, unknown_name
from mjnav.loop.result import RunSummary
from mjnav.metrics.safety import KINDS
from mjnav.metrics.summary import Figures
from mjnav.study.compare.before_after import BETTER, OTHER, WORSE, BeforeAfter
from mjnav.study.compare.chosen_figures import is_cost, numbers
from mjnav.study.compare.compare import MethodRow
from mjnav.study.compare.study_comparison import CellPlace, StudyComparison
from mjnav.study.store.row import FIGURES, is_own

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
        found = _FORM.fullmatch(text.strip())
        if found is None:
            raise InvalidValue("", text, ALLOWED, file=OPTION)
        word = found["value"]
        try:
            value: float | str = _WORDS[word] if word in _WORDS else float(word)
        except ValueError:
            value = word
        if isinstance(value, str) and found["operator"] != "==":
            raise InvalidValue(found["figure"], word, f"a number behind {found['operator']}", file=OPTION)
        if isinstance(value, float) and not isfinite(value):
            raise InvalidValue(found["figure"], word, "a finite number", file=OPTION)
        return cls(text, (found["where"] or "").strip(), found["figure"], found["operator"], value)

    def met_by(self, found: Value) -> bool:
        """Whether a figure of this value meets it."""
        if isinstance(found, str) or isinstance(self.value, str):
            return found == self.value
        return found is not None and _OPERATORS[self.operator](found, self.value)

    def covers(self, cell: Sequence[str]) -> bool:
        """Whether it is about the cell of these labels: scene, setting and method."""
        scene, setting, method = cell
        pairs = (f"{scene}/{setting}", f"{scene}/{method}", f"{setting}/{method}")
        names = (scene, setting, method, *pairs, f"{scene}/{setting}/{method}")
        return not self.where or any(self.where == name or fnmatchcase(name, self.where) for name in names)


@dataclass(frozen=True, slots=True)
class Answer:
    """What one requirement found in one run or cell."""

    requirement: Requirement
    found: Value
    cell: tuple[str, str, str] | None = None  # scene, setting and method; None of a run

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
    return [Answer(one, _value(figures[check_figure(one, figures)])) for one in requirements]


def of_cells(
    requirements: Iterable[Requirement], cells: Mapping[tuple[str, str, str], Mapping[str, object]]
) -> list[Answer]:
    """What the requirements find in the cells of a table, each cell's figures by name.

    Raises InvalidValue for a figure that is not there, InputError for a requirement on no cell.
    """
    answers = []
    for one in requirements:
        covered = [cell for cell in cells if one.covers(cell)]
        if not covered:
            named = "; ".join("/".join(cell) for cell in list(cells)[:5])
            raise InputError(f"{OPTION} {one.text}: no cell is {one.where!r}; there are {named}")
        answers += [Answer(one, _value(cells[cell][check_figure(one, cells[cell])]), cell) for cell in covered]
    return answers


def run_figures() -> list[str]:
    """The figures of any run: its summary's keys, those of inner tables joined by "_" as in the rows of a sweep."""
    kinds = [f"collisions_{kind}" for kind in KINDS]
    inner = [name for name in FIGURES if name in kinds or name.startswith("compute_ms_")]
    own = [field.name for field in (*fields(Figures), *fields(RunSummary)) if field.name in FIGURES]
    return [*own, *inner]


def check_figure(requirement: Requirement, names: Iterable[str]) -> str:
    """The figure of a requirement, which is one of `names`. Raises InvalidValue."""
    names = list(names)
    if requirement.figure not in names:
        raise unknown_name(OPTION, requirement.figure, names)
    return requirement.figure


def _value(found: object) -> Value:
    if found is None or isinstance(found, str):
        return found
    value = float(found)  # type: ignore[arg-type]
    return value if isfinite(value) else None


def _text(value: Value) -> str:
    return "null" if value is None else value if isinstance(value, str) else f"{value:.6g}"


# ----------------------------------------------------------------------------------- figures of cells


COUNTS = ("episodes", "failed", "missing")
PLAIN = ("infeasible_share", "decision_ms", "decision_p99_ms")
WIN_SHARE = "win_share"  # of the pairs that are no ties, against the reference
RATIO = "_ratio"  # end of the name of a ratio of costs to the reference: time_s_ratio
PAIRS = ("pairs", "identical", BETTER, WORSE, OTHER)
CHANGE = "_change"  # end of the name of a paired difference: success_change

Cells = Mapping[CellPlace, Mapping[str, object]]


def figures_for(required: Iterable[Requirement], *, after: bool = False) -> list[str]:
    """The columns that a table needs for these requirements; with `after`, a table of before and after.

    Raises InvalidValue for a figure that such a table cannot have.
    """
    known = numbers()
    others = [*PLAIN, WIN_SHARE, *(PAIRS if after else COUNTS)]
    end = CHANGE if after else RATIO
    found = []
    for requirement in required:
        name = requirement.figure if requirement.figure in known else requirement.figure.removesuffix(end)
        if name not in known and requirement.figure not in others and not is_own(name):
            raise unknown_name(OPTION, requirement.figure, (*known, *others))
        if name in known or is_own(name):
            found.append(name)
    return found


def of_study(results: StudyComparison) -> Cells:
    """The point estimates of every cell, and how many episodes it has."""
    return {
        place: _figures(row)
        | _ratios(row)
        | {"episodes": row.num, "failed": row.num_failed, "missing": results.missing.get(place, 0)}
        for table in results.tables
        for row in table.rows
        for place in [(table.scene, table.setting, row.method)]
    }


def of_before_after(found: BeforeAfter) -> Cells:
    """The point estimates after, the paired differences, and how many pairs changed in which way."""
    return {
        (cell.scene, cell.setting, cell.method): _figures(cell.after)
        | {f"{name}{CHANGE}": change.estimate.value for name, change in cell.after.differences.items()}
        | {"pairs": cell.pairs, "identical": cell.identical}
        | {kind: len(cell.named(kind)) for kind in (BETTER, WORSE, OTHER)}
        for cell in found.cells
    }


def _figures(row: MethodRow) -> dict[str, object]:
    own: dict[str, object] = {name: estimate.value for name, estimate in row.figures.items()}
    own |= {name: getattr(row, name) for name in PLAIN}
    return own | {WIN_SHARE: None if row.wins is None else row.wins.share}


def _ratios(row: MethodRow) -> dict[str, object]:
    """Of every cost the ratio to the reference's; None where it is undefined."""
    found: dict[str, object] = {}
    for name in filter(is_cost, row.figures):
        ratio = row.differences[name].ratio if name in row.differences else None
        found[f"{name}{RATIO}"] = None if ratio is None else ratio.value
    return found

"""The figures that requirements may be about: of each cell of a table, or of a cell before and after."""

from collections.abc import Iterable, Mapping

from mjnav.errors import unknown_name
from mjnav.study.compare.before_after import BETTER, OTHER, WORSE, BeforeAfter
from mjnav.study.compare.chosen_figures import is_cost, numbers
from mjnav.study.compare.compare import MethodRow
from mjnav.study.compare.study_comparison import CellPlace, StudyComparison
from mjnav.study.requirements import OPTION, Requirement
from mjnav.study.store.own_figures import is_own

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

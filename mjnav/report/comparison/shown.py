"""A comparison's tables as they are shown: the same cells, words and sentences in text, LaTeX and HTML.

A row is a method, a column a figure: its estimate, and below it the difference from the reference, or the ratio to it.
The win ratios of every two methods are one more table, in which a row is compared with a column.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from mjnav.printable import printable
from mjnav.report.figure_text import FigureName, Format, Shown, column_format, definition, figure_name, shown_ratio
from mjnav.study.compare.before_after import BeforeAfter
from mjnav.study.compare.cell_rows import FAULT, RATES, WIN_BY, is_cost, is_rate, over_all
from mjnav.study.compare.estimates import RESAMPLES, Estimate, WinRatio
from mjnav.study.compare.study_comparison import Comparison, MethodRow, StudyComparison

# -------------------------------------------------------------------------------------------- tables

# Figures without intervals: what a terminal calls them, and how they are printed.
PLAIN: Mapping[str, tuple[str, Format]] = MappingProxyType(
    {
        "infeasible_share": ("infeasible %", Format(1, 100.0)),
        "decision_ms": ("decision ms", Format(2)),
        "decision_p99_ms": ("decision p99 ms", Format(2)),
    }
)
WINS, EPISODES = "win_ratio", "episodes"
RIVALS = "win ratio, row against column"


@dataclass(frozen=True, slots=True)
class Cell:
    """One figure of one method."""

    own: Shown
    below: Shown | None = None  # the difference from the reference; None of the reference itself and without one


@dataclass(frozen=True, slots=True)
class Column:
    """A figure, or the method that a row is compared with."""

    figure: str  # as `--figure` takes it
    title: str  # in a terminal
    name: FigureName  # in print
    about: str  # what it is
    cells: tuple[Cell, ...]  # one a row


@dataclass(frozen=True, slots=True)
class ShownTable:
    """Columns under a title; `methods` are the heads of the rows."""

    title: str
    methods: tuple[str, ...]
    columns: tuple[Column, ...]

    @property
    def rows(self) -> Iterator[tuple[str, list[Cell]]]:
        """Each method with its cells."""
        for i, method in enumerate(self.methods):
            yield method, [column.cells[i] for column in self.columns]


def shown_tables(table: Comparison, *, ratios: bool = False) -> Iterator[ShownTable]:
    """The figures of a table, and where they were asked for, the win ratios of every two methods."""
    methods = tuple(row.label for row in table.rows)
    episodes = tuple(map(_episodes, table.rows))
    about_episodes = "rows, and of how many where some are missing"
    columns = [Column(EPISODES, "n", FigureName(EPISODES), about_episodes, episodes)]
    columns += [_figure(table, figure) for figure in RATES]
    if any(row.wins is not None for row in table.rows):
        columns.append(_column(WINS, WINS, [Cell(_wins(row.wins, row)) for row in table.rows]))
    for figure, (title, form) in PLAIN.items():
        estimates = [Estimate(row.plain[figure], None, row.num) for row in table.rows]
        columns.append(_column(figure, title, [Cell(form.shown(e, e.num)) for e in estimates]))
    columns += [_figure(table, name, ratios=ratios) for name in table.rows[0].figures if name not in RATES]
    yield ShownTable("", methods, tuple(columns))
    if table.rivals:
        against = [(row, dict(table.rivals_of(row.method))) for row in table.rows]
        columns = []
        for other in table.rows:
            cells = tuple(Cell(_wins(ratios_of.get(other.method), row)) for row, ratios_of in against)
            columns.append(Column(WINS, other.label, FigureName(f"against {other.label}"), "", cells))
        yield ShownTable(RIVALS, methods, tuple(columns))


def _column(figure: str, title: str, cells: Iterable[Cell]) -> Column:
    return Column(figure, title, figure_name(figure), f"{figure}: {definition(figure)}", tuple(cells))


def _episodes(row: MethodRow) -> Cell:
    """How many episodes: 20, 18/20 where some are missing, 20 (1 failed)."""
    wanted = f"/{row.num + row.num_missing}" if row.num_missing else ""
    failed = f"({row.num_failed} failed)" if row.num_failed else ""
    return Cell(Shown(f"{row.num}{wanted}", count=failed, estimate=Estimate(row.num, None, row.num)))


def _wins(wins: WinRatio | None, row: MethodRow) -> Shown:
    """Nothing of a method against itself."""
    if wins is None:
        return Shown("")
    return shown_ratio(Estimate(wins.value, wins.interval, wins.pairs), row.num, p=wins.p)


def _figure(table: Comparison, figure: str, *, ratios: bool = False) -> Column:
    rate = is_rate(figure)
    estimates = [row.figures[figure] for row in table.rows]
    if not rate:  # whose differences are no finer than they
        estimates += [row.differences[figure].estimate for row in table.rows if row.differences]
    form = column_format(estimates, rate=rate)

    def cell(row: MethodRow) -> Cell:
        own, change = form.shown(row.figures[figure], row.num), row.differences.get(figure)
        if change is None:
            return Cell(own)
        if ratios and is_cost(figure):
            return Cell(own, shown_ratio(change.ratio, row.num, "×", change.p))
        return Cell(own, form.shown(change.estimate, row.num, "+", change.p))

    return _column(figure, f"{figure} %" if rate else figure, map(cell, table.rows))


# ----------------------------------------------------------------------------------- what a table is of


MAX_BEHAVIOURS = 3


def about(table: Comparison) -> list[str]:
    """How many layouts a table has, and whether its people see the robot."""
    layouts = "one layout" if table.num_layouts == 1 else f"{table.num_layouts} layouts"
    return [layouts, *filter(None, [sight(table.people)])]


def sight(people: Sequence[str]) -> str:
    """In words, from the values of `people_see_robot` in a table's rows; "" without people or where it is not known."""
    match tuple(people):
        case ():
            return ""
        case ("all",):
            return "people see the robot"
        case ("none",):
            return "people do not see the robot"
        case (some,):
            return f"{some} people see the robot"
        case several:
            more = f" and {len(several) - MAX_BEHAVIOURS} more" if len(several) > MAX_BEHAVIOURS else ""
            return f"people see the robot by seed: {', '.join(several[:MAX_BEHAVIOURS])}{more}"


# ------------------------------------------------------------------------------- meaning and warnings


FEW_SEEDS = 20  # below it a studentised interval of very skewed figures holds the mean in 90 of 100 cases only
MAX_NAMED = 5


def meaning(results: StudyComparison) -> Iterator[str]:
    """What figures, intervals, differences and marks of a study are."""
    reference = "the table's reference"
    wins = any(row.wins is not None for _, row in results.rows)
    yield from _meaning(results.figures, wins, reference, "the methods of a table", ratios=results.ratios)
    if results.settings_per_table > 1:
        yield (
            f"{results.scenes_per_table} scenes and {results.settings_per_table} settings in one table: a pair is one "
            "scene, setting and seed. Intervals and p-values are of layouts (in a scene that draws nothing, of seeds), "
            "each with its episodes in all settings: means by drawing layouts, rates with Rao and Scott's design "
            "effect, tests by sign flips."
        )
    elif results.scenes_per_table > 1:
        yield f"{results.scenes_per_table} scenes in one table: a pair is one scene and seed."


def meaning_of_changes(results: BeforeAfter) -> Iterator[str]:
    """The same of two folders of results."""
    figures = dict.fromkeys(figure for cell in results.cells for figure in cell.before.figures)
    yield from _meaning(list(figures), True, "before, of the seeds that both folders have", "the cells")


def _meaning(
    figures: Sequence[str], wins: bool, reference: str, holm_over: str, *, ratios: bool = False
) -> Iterator[str]:
    of_all = [figure for figure in figures if over_all(figure) and not is_rate(figure)]
    of_all_text = f" ({', '.join(of_all)}: over all)" * bool(of_all)
    below = "ratios of means (×), of other figures differences," if ratios else "differences"
    fault = "; fault % a person touched by the robot's fault" * (FAULT in figures)
    yield (
        f"success % is the goal reached without contact, in time; collision % any contact{fault}; with Wilson 95 % "
        "intervals."
    )
    yield (
        f"Other figures are means over the seeds that succeeded{of_all_text}, with studentised 95 % bootstrap "
        f"intervals ({RESAMPLES} resamples); in parentheses from how many seeds, where not from all n."
    )
    yield (
        f"Below them are {below} against {reference}, over the seeds on which both succeeded "
        "(rates, and what is over all: over all common seeds), with paired bootstrap intervals."
    )
    if wins:
        yield (
            "win_ratio is the number of pairs in which a method did better than the other over those in which it did "
            f"worse. A contact is worst, then a goal not reached in time; two successes are compared by {WIN_BY}; what "
            "is equal is a tie. Its interval is Wilson's of the share of wins among the pairs that are no ties."
        )
    yield (
        "* p < 0.05 by a sign-flip test on the pairs (rates: McNemar's; win ratios: binomial), with Holm's "
        f"correction over {holm_over}, each figure by itself."
    )
    yield (
        "infeasible % is the share of all ticks at which nothing met the constraints; decision ms and decision p99 ms "
        "are medians over episodes of their median and 99th percentile of the wall time of a decision."
    )


def warnings(results: StudyComparison) -> Iterator[str]:
    """What is missing, what failed, and what calls for care."""
    fewest = min((row.num_units for _, row in results.rows), default=0)
    if results.num_seeds is None:
        yield "No study file is there to say which episodes are missing."
    if results.num_missing:
        wanted = results.num_episodes + results.num_missing
        yield (
            f"Incomplete: {results.num_missing} of the study's {wanted} episodes are missing. `mjnav sweep --resume` "
            "adds them."
        )
    if results.absent:
        cells = [f"scene {scene}, setting {setting}, method {method}" for scene, setting, method in results.absent]
        yield f"{len(cells)} cells have no episode at all: {_some(cells)}."
    if results.causes:
        causes = [f"{count} × {cause}" for cause, count in results.causes.most_common()]
        yield f"{results.causes.total()} episodes failed, and count in n alone: {_some(causes)}."
    if fewest < FEW_SEEDS:
        what = "layouts" if results.settings_per_table > 1 else "seeds"
        yield f"The fewest {what} of a cell are {fewest}: of fewer than {FEW_SEEDS} bootstrap intervals are too narrow."
    without = [table.title for table in results.tables if not table.reference]
    if without:
        yield f"Without the reference, and so without differences: {_some(without)}."
    if len(results.revisions) > 1:
        yield f"Rows of several revisions of mjnav: {_some(results.revisions)}."
    for inconsistency in results.inconsistencies:
        yield f"Not all rows were made alike: {printable(str(inconsistency))}."
    if len(results.machines) > 1:
        yield f"Times of decisions are wall clock of {len(results.machines)} machines, and do not compare between them."
    if results.others:
        yield f"Rows of other studies in the folder are left out: {_some(results.others)}."


def _some(names: Sequence[str]) -> str:
    more = f"; {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return printable("; ".join(names[:MAX_NAMED])) + more

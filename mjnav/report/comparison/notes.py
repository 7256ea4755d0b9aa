"""Notes on the tables of a comparison, in sentences: what the figures mean, what is missing, what calls for care.

Two notes are about a table's data. One is how many layouts the table has: the layout is the unit of evidence, as seeds
of one layout differ in their noise alone. The other is whether the people of the table see the robot: what a method
does among people who give way says nothing about people who do not.
"""

from collections.abc import Iterator, Sequence

from mjnav.printable import printable
from mjnav.study.compare.chosen_figures import FAULT, is_rate, over_all
from mjnav.study.compare.estimates import RESAMPLES
from mjnav.study.compare.study_comparison import StudyComparison

# -------------------------------------------------------------------------------------------- layouts


def layouts(num: int) -> str:
    """In words."""
    return "one layout" if num == 1 else f"{num} layouts"


# ----------------------------------------------------------------------- whether people see the robot


MAX_BEHAVIOURS = 3


def sight(people: Sequence[str]) -> str:
    """In words, from the values of `people_see_robot` in a table's rows; "" without people or where it is not known."""
    match tuple(people):
        case ():
            return ""
        case ("all",):
            return "people see the robot"
        case ("none",):
            return "people do not see the robot"
        case (one,):
            return f"{one} people see the robot"
        case several:
            more = f" and {len(several) - MAX_BEHAVIOURS} more" if len(several) > MAX_BEHAVIOURS else ""
            return f"people see the robot by seed: {', '.join(several[:MAX_BEHAVIOURS])}{more}"


def of_table(people: Sequence[str]) -> str | None:
    """The same as one value for programs: "all", "none", "3 of 5", or several with commas; None without a text."""
    return ", ".join(people) or None


# ------------------------------------------------------------------------------- meaning and warnings


FEW_SEEDS = 20  # below it a percentile bootstrap's interval is too narrow
MAX_NAMED = 5


def meaning(results: StudyComparison) -> list[str]:
    """What figures, intervals, differences and marks are."""
    of_all = [figure for figure in results.figures if over_all(figure) and not is_rate(figure)]
    of_all_text = f" ({', '.join(of_all)}: over all)" * bool(of_all)
    pairs = _pairs(results.scenes_per_table, results.settings_per_table)
    below = "ratios of means (×), of other figures differences," if results.ratios else "differences"
    win_by = {table.win_by for table in results.tables if any(row.wins is not None for row in table.rows)}
    fault = "; fault % a person touched by the robot's fault" * (FAULT in results.figures)
    return [
        f"success % is the goal reached without contact, in time; collision % any contact{fault}; with Wilson 95 % "
        "intervals.",
        f"Other figures are means over the seeds that succeeded{of_all_text}, with 95 % bootstrap intervals "
        f"({RESAMPLES} resamples); in parentheses from how many seeds, where not from all n.",
        f"Below them are {below} against the table's reference, over the seeds on which both succeeded "
        "(rates, and what is over all: over all common seeds), with paired bootstrap intervals.",
        *(_win_ratio(by) for by in sorted(win_by)),
        "* p < 0.05 by a sign-flip test on the pairs (rates: McNemar's; win ratios: binomial), with Holm's "
        "correction over the methods of a table, each figure by itself.",
        "infeasible % is the share of all ticks at which nothing met the constraints; decision ms and decision p99 ms "
        "are medians over episodes of their median and 99th percentile of the wall time of a decision.",
        *pairs,
    ]


def _win_ratio(by: str) -> str:
    return (
        "win_ratio is the number of pairs in which a method did better than the other over those in which it did "
        f"worse. A contact is worst, then a goal not reached in time; two successes are compared by {by}; what is "
        "equal is a tie. Its interval is Wilson's of the share of wins among the pairs that are no ties."
    )


def _pairs(num_scenes: int, num_settings: int) -> Iterator[str]:
    """What is pooled."""
    if num_settings > 1:
        yield (
            f"{num_scenes} scenes and {num_settings} settings in one table: a pair is one scene, setting and seed. "
            "Intervals and p-values are of layouts (in a scene that draws nothing, of seeds), each with its episodes "
            "in all settings: means by drawing layouts, rates with Rao and Scott's design effect, tests by sign flips."
        )
    elif num_scenes > 1:
        yield f"{num_scenes} scenes in one table: a pair is one scene and seed."


def warnings(results: StudyComparison) -> list[str]:
    """What is missing, what failed, and what calls for care."""
    return [*_missing(results), *_failed(results), *_care(results)]


def _missing(results: StudyComparison) -> Iterator[str]:
    if results.num_seeds is None:
        yield "No study file is there to say which episodes are missing."
    if results.num_missing:
        wanted = results.num_episodes + results.num_missing
        cells = sum(map(bool, results.missing.values()))
        lacking = [lack for lack in results.missing.values() if lack]
        text = f"Incomplete: {results.num_missing} of the study's {wanted} episodes are missing"
        if lacking:
            least, most = min(lacking), max(lacking)
            span = f"{least}" if least == most else f"{least} to {most}"
            seeds = (results.num_seeds or 0) * results.scenes_per_table
            text += f", {span} of {seeds} seeds in {cells} of {len(results.missing)} cells"
        yield f"{text}. `mjnav sweep --resume` adds them."
    if results.absent:
        named = [f"scene {scene}, setting {setting}, method {method}" for scene, setting, method in results.absent]
        yield f"{len(named)} cells have no episode at all: {_some(named)}."


def _failed(results: StudyComparison) -> Iterator[str]:
    failed = sum(results.causes.values())
    if failed:
        causes = [f"{count} × {cause}" for cause, count in results.causes.most_common()]
        yield f"{failed} episodes failed, and count in n alone: {_some(causes)}."


def _care(results: StudyComparison) -> Iterator[str]:
    fewest = min((row.num_units for table in results.tables for row in table.rows), default=0)
    what = "layouts" if results.settings_per_table > 1 else "seeds"
    if fewest < FEW_SEEDS:
        yield f"The fewest {what} of a cell are {fewest}: bootstrap intervals of fewer than {FEW_SEEDS} are too narrow."
    without = [f"{table.scene}, {table.setting}" for table in results.tables if not table.reference]
    if without:
        yield f"Without the reference, and so without differences: {_some(without)}."
    if len(results.revisions) > 1:
        yield f"Rows of several revisions of mjnav: {_some(list(results.revisions))}."
    for inconsistency in results.inconsistencies:
        yield f"Not all rows were made alike: {printable(str(inconsistency))}."
    if len(results.machines) > 1:
        yield f"Times of decisions are wall clock of {len(results.machines)} machines, and do not compare between them."
    if results.others:
        yield f"Rows of other studies in the folder are left out: {_some(list(results.others))}."


def _some(names: list[str]) -> str:
    more = f"; {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return printable("; ".join(names[:MAX_NAMED])) + more

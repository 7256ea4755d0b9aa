"""The items that compare methods by the episodes of studies: what each claims, and its bars."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import product
from types import MappingProxyType

import numpy as np

from mjnav.messages import Array
from mjnav.metrics.intervals import mcnemar, wilson
from mjnav.paper.claims import LEAST_PAIRS, Cells, Claim, Measured, StudyItem, by_place, contrasts, effect, measured
from mjnav.paper.draw import bars
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import common, paired

LESS: Mapping[str, str] = MappingProxyType(  # what a method takes where the figure is less
    {
        "control_cost": "less control cost",
        "mean_deviation_m": "less deviation from the way",
        "path_ratio": "a shorter way",
        "time_to_avoid_s": "less time to avoid",
        "collision": "fewer collisions",
    }
)
MEASURES = ("control_cost", "mean_deviation_m", "path_ratio", "time_to_avoid_s")
RKHS = ("rkhs d=1", "rkhs d=2", "rkhs d=3")
LINEARISED = "gaussian-linearised"
LEAST_ETA, TUNED_ETA, MOST_ETA = (f"gaussian-moments eta={eta}" for eta in (0.5, 0.7, 0.99))


def _item(
    title: str,
    studies: Sequence[str],
    claims: Callable[[Cells], Iterable[Claim]],
    methods: Sequence[str],
    figures: Sequence[str],
    limits: str = "",
) -> StudyItem:
    """An item whose picture are the bars of these methods."""
    return StudyItem(title, tuple(studies), claims, lambda cells: bars(cells, methods, figures), limits)


def _takes_less(cells: Cells, method: str, rival: str, figure: str, source: str, where: str = "") -> Claim:
    text = f"{where}{method} takes {LESS[figure]} than {rival}"
    return Claim(text, source, contrasts(cells, method, rival, figure, -1))


# ------------------------------------------------------------------------------- the degree of the kernel

# Degree d multiplies the weight of the mean's term by d (offset 1). So degrees are compared at one weight, as in the
# paper, and at weights that make the mean's term weigh alike.
DEGREES = ("d=1", "d=2", "d=3", "d=2 matched", "d=3 matched")
HOW: Mapping[str, str] = MappingProxyType({"": "at one weight", " matched": "at matched weights of the mean's term"})


def _degree(cells: Cells) -> Iterator[Claim]:
    """d = 3 against d = 1."""
    for figure, what in (
        ("mean_safe_share", "avoids a larger share of the samples (eta)"),
        ("min_clearance_m", "keeps a larger distance from the obstacle"),
        ("mean_deviation_m", "leaves the way farther"),
        ("control_cost", "costs more control"),
    ):
        for suffix, how in HOW.items():
            tests = contrasts(cells, f"d=3{suffix}", "d=1", figure, +1)
            yield Claim(f"Degree 3 {what} than degree 1, {how}", "figure 5, section V-C", tests)


def _lane(cells: Cells) -> Iterator[Claim]:
    """Degrees 2 and 3 against 1; distances are means over time, of the robot's edge from the nearer boundary."""
    for (suffix, how), d in product(HOW.items(), (2, 3)):
        tests = contrasts(cells, f"d={d}{suffix}", "d=1", "mean_lane_clearance_m", +1)
        text = f"Degree {d} stays farther from the lane's boundary than degree 1, {how}"
        yield Claim(text, "figure 6c, d, section V-B", tests)


DEGREE = _item(
    "The degree of the kernel, against one obstacle",
    ["paper-degree"],
    _degree,
    DEGREES,
    ["mean_safe_share", "min_clearance_m", "mean_deviation_m", "control_cost"],
    "Degree 1 is the squared difference of the two means, after the samples are clipped: it sees no other moment of "
    "the distributions.",
)
LANE = _item(
    "The lane: distance from its boundary",
    ["paper-lane"],
    _lane,
    DEGREES,
    ["mean_lane_clearance_m", "min_lane_clearance_m", "mean_deviation_m"],
)


# ------------------------------------------------------------------------------------------ the table

BETWEEN, AROUND = "between the legs", "around"
HALF_WIDTH = 0.75  # [m] from the way to a leg: a run that leaves the way by more goes around


def between_legs(cell: CellRows) -> Array:
    """Of the runs that reached the goal without contact, which went between the legs; (n,) of 0 and 1."""
    deviation = cell.values("max_deviation_m")
    return (deviation[np.isfinite(deviation)] < HALF_WIDTH).astype(float)


def _table(cells: Cells) -> Iterator[Claim]:
    """Whether most runs took the way that the paper shows."""
    for method, name, way in (
        ("d=1", "Degree 1", BETWEEN),
        ("d=1 matched", "Degree 1, as heavy as degree 3,", BETWEEN),
        ("d=3", "Degree 3", AROUND),
    ):
        tests = [_most(where, cell, way) for where, cell in by_place(cells, method).items()]
        yield Claim(f"{name} goes {way} in most runs", "figure 6a, b, section V-B", tests)


def _most(where: str, cell: CellRows, way: str) -> Measured:
    """The exact binomial test of one half."""
    between = between_legs(cell)
    took = between if way == BETWEEN else 1.0 - between
    num, failed = int(took.sum()), int(cell.failed.sum())
    lost = f"{len(cell.seeds) - took.size - failed} more did not reach the goal unharmed"
    lost += f", {failed} episodes failed" if failed else ""
    interval = wilson(num, took.size)
    if interval is None:
        return Measured(False, None, f"{where}: no run reached the goal without contact, {lost}")
    low, high = (100.0 * end for end in interval)
    line = f"{where}: {100.0 * took.mean():.1f} % [{low:.1f}, {high:.1f}] of {took.size} runs, {lost}"
    return Measured(2 * num > took.size, mcnemar(num, took.size - num) if took.size >= LEAST_PAIRS else None, line)


TABLE = _item(
    "The table: between its legs or around it",
    ["paper-table"],
    _table,
    ("d=1", "d=2", "d=3", "d=1 matched"),
    ["max_deviation_m", "collision"],
)


# ------------------------------------------------------------------------- against other methods, as tuned


def _one(cells: Cells) -> Iterator[Claim]:
    """The measures, what the moment surrogate's eta does to its feasibility, and assumption 1."""
    for rival, figure, method in product((LINEARISED, TUNED_ETA), MEASURES, RKHS):
        yield _takes_less(cells, method, rival, figure, "figure 7, section V-C")
    low, high = by_place(cells, LEAST_ETA), by_place(cells, MOST_ETA)
    tests = [_less_feasible(where, low.get(where), high.get(where)) for where in dict.fromkeys((*low, *high))]
    text = "The moment surrogate finds nothing that meets its constraint the more often, the higher the eta it asks for"
    yield Claim(text, "figure 7, section V-C", tests)
    nominal = [_nominal(where, cell) for where, cell in by_place(cells, "rkhs d=1").items()]
    yield Claim("A nominal control always exists", "assumption 1", nominal)


def _less_feasible(where: str, low: CellRows | None, high: CellRows | None) -> Measured:
    """That the share of ticks without a control that meets the constraint grows from the least eta to the most."""
    change = np.empty(0)
    if low is not None and high is not None:
        at_high, at_low = common(high, low)
        lacking_high, lacking_low = (cell.columns["ticks_without_own"] / cell.columns["ticks"] for cell in (high, low))
        change = 100.0 * (lacking_high[at_high] - lacking_low[at_low])
    return measured(f"{where}: share of ticks, most eta less the least", paired(change), +1, "points")


def _nominal(where: str, cell: CellRows) -> Measured:
    """That some control met the constraints at the mean at every tick. One counterexample refutes it, with p = 0."""
    always = cell.columns["ticks_without_nominal"][~cell.failed] == 0
    interval = wilson(int(always.sum()), always.size)
    if interval is None:
        return Measured(False, None, f"{where}: no episode has a result")
    low, high = (100.0 * end for end in interval)
    line = f"{where}: at every tick in {100.0 * always.mean():.1f} % [{low:.1f}, {high:.1f}] of {always.size} runs"
    return Measured(bool(always.all()), 0.0 if always.size >= LEAST_PAIRS else None, line)


def _many(cells: Cells) -> Iterator[Claim]:
    """Every measure for every number of obstacles."""
    for figure, number in product(MEASURES, (1, 2, 3)):
        of_scene = [cell for cell in cells if cell.scene == f"crossing{number}"]
        where = f"With {number} obstacle{'s' * (number > 1)}, "
        yield _takes_less(of_scene, "rkhs d=3", LINEARISED, figure, "figure 8, section V-D", where)


READING = ("reading d=1", "reading d=2", "reading d=3")
READ_AGAINST = ((LINEARISED, MEASURES), ("gaussian-moments", MEASURES), ("kld", MEASURES[:1]))


def _reading(cells: Cells) -> Iterator[Claim]:
    """The paper's method read in its favour, for a robot that may stop and one that drives on."""
    for drive, (rival, figures), method in product(("may stop", "drives on"), READ_AGAINST, READING):
        of_robot = [cell for cell in cells if cell.setting.startswith(drive)]
        for figure in figures:
            yield _takes_less(of_robot, method, rival, figure, "figures 7, 8; section V", f"Of a robot that {drive}: ")


LIMITS = (
    "The robot of these scenes may stop, and a method that waits for a person deviates little; `reading` has one that "
    "cannot stop, too. The methods also differ in that rkhs weighs its risk and its rivals forbid."
)
ONE = _item(
    "One obstacle: control cost, deviation, time to avoid",
    ["paper-one"],
    _one,
    (*RKHS, LINEARISED, LEAST_ETA, TUNED_ETA, MOST_ETA),
    ["control_cost", "mean_deviation_m", "time_to_avoid_s", "infeasible_ticks"],
    LIMITS,
)
MANY = _item(
    "One, two and three obstacles",
    ["paper-one", "paper-many"],
    _many,
    ("rkhs d=3", LINEARISED),
    ["control_cost", "mean_deviation_m", "time_to_avoid_s", "collision"],
    LIMITS,
)
STRONGEST = _item(
    "The paper's method read in its favour; a robot that cannot stop",
    ["paper-reading"],
    _reading,
    (*READING, LINEARISED, "gaussian-moments", "kld"),
    ["control_cost", "mean_deviation_m", "time_to_avoid_s", "collision"],
    "Its rivals are as the protocol of tuning found them best, too. All scenes are kinematic, with skewed noise.",
)


# ------------------------------------------------------------------------ what a method owes to its surroundings

SHAPE_METHODS = ("rkhs d=1", "rkhs d=3", "kld", "saa", "gaussian-moments")


def _shape(cells: Cells) -> Iterator[Claim]:
    """Samples of the noise's own shape against mirrored and Gaussian ones, by method."""
    at = {(cell.method, cell.setting): cell for cell in cells}
    for method, wrong, figure in product(SHAPE_METHODS, ("mirrored", "gaussian"), ("collision", "control_cost")):
        tests = [
            effect(noise, [(at.get((method, f"{noise}, true")), at.get((method, f"{noise}, {wrong}")))], figure, -1)
            for noise in ("pearson", "bimodal")
        ]
        text = f"{method} gives {LESS[figure]} with samples of the noise's own shape than with {wrong} ones"
        yield Claim(text, "the premise, section I", tests)


# name -> its level in the paper and here, as a setting's label has them
LEVELS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "The segment form of the cone in place of the line form": ("form=line", "form=segment"),
        "A preview of 0.4 s in place of one period": ("preview=0.1", "preview=0.4"),
        "Prediction of the delay": ("prediction=false", "prediction=true"),
    }
)
ENGINES = ("kinematic", "mujoco")
RIVALS: Mapping[str, str] = MappingProxyType(
    {"mean": "constraints at the mean (mean)", "saa": "a bound on the share of samples that collide (saa)"}
)
FACTOR_METHODS = ("rkhs", "saa", "mean")


def _factors(cells: Cells) -> Iterator[Claim]:
    """Each factor's effect on collisions and cost for each method, and the method's own.

    The effect of a factor is the mean over the other two of the difference between its levels, seed by seed.
    """
    at = {(cell.method, cell.setting): cell for cell in cells}
    source = "what the paper does not vary"
    for figure, what in (("collision", "avoids collisions"), ("control_cost", "saves control")):
        settings = {
            engine: [f"{engine}, {' '.join(levels)}" for levels in product(*LEVELS.values())] for engine in ENGINES
        }
        for name, (before, after) in LEVELS.items():
            tests = []
            for method, engine in product(FACTOR_METHODS, ENGINES):
                changed = [setting for setting in settings[engine] if after in setting]
                pairs = [(at.get((method, s)), at.get((method, s.replace(after, before)))) for s in changed]
                tests.append(effect(f"{method}, {engine}", pairs, figure, -1))
            yield Claim(f"{name} {what}", source, tests)
        for rival, description in RIVALS.items():
            tests = [
                effect(engine, [(at.get(("rkhs", s)), at.get((rival, s))) for s in settings[engine]], figure, -1)
                for engine in ENGINES
            ]
            text = f"Matching by a weight (rkhs) {what}, against {description}, the factors being equal"
            yield Claim(text, source, tests)


SHAPE = _item(
    "Does the method use the shape of the noise?",
    ["paper-shape"],
    _shape,
    SHAPE_METHODS,
    ["collision", "min_clearance_m", "control_cost", "mean_deviation_m"],
)
FACTORS = _item(
    "Cone form, preview, prediction of the delay",
    ["paper-factors"],
    _factors,
    FACTOR_METHODS,
    ["collision", "control_cost", "mean_deviation_m", "min_clearance_m"],
    "The claim that matching takes less control than saa is withdrawn: rkhs weighs its risk against the goal, saa "
    "forbids what exceeds a bound, so the difference is one of a soft against a hard constraint as much as of "
    "matching. What is left is that this rkhs, at this weight, differs from this saa, at this bound.",
)


# ------------------------------------------------------------------------------------------ real time

PERIOD = 100.0  # [ms] of the scene's decisions
SAMPLES = "samples=25"  # the paper's


def _real_time(cells: Cells) -> Iterator[Claim]:
    """The slowest decisions with the paper's number of samples against the period."""
    for method in DEGREES[:3]:
        timed = [cell for cell in cells if cell.method == method and cell.setting == SAMPLES]
        tests = [
            measured("less the period", paired(cell.columns["compute_ms_control_p99"] - PERIOD), -1, "ms")
            for cell in timed
        ]
        text = f"With 25 samples of robot and obstacles, {method}, 99 of 100 decisions take less than their period"
        yield Claim(text, "section V: 25 samples of robot and obstacle, real time", tests)


REAL_TIME = _item(
    "Real time: how long a decision takes, by the number of samples",
    ["paper-time"],
    _real_time,
    DEGREES[:3],
    ["compute_ms_control_p50", "compute_ms_control_p99"],
    "Times are of this machine, and of what else it did.",
)

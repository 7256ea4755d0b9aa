"""Real time (section V): how long a decision takes, against samples and the kernel's degree.

Runs are recorded with as many samples as asked and five people, all in reach; then each degree in turn decides on
their observations again, in one thread. These times are compared with those of the literal form: the time of the Gram
matrices of one candidate and one obstacle, times their number. All times are of this machine and its load.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from time import perf_counter
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mjnav.control.methods.rkhs import Rkhs
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.realtime.stress import crowd
from mjnav.messages import Array, Observation
from mjnav.paper import draw
from mjnav.paper.claims import Claim, Measured, MeasuredItem, Progress, bootstrap_p
from mjnav.paper.episodes import DIRECT, changed, spread
from mjnav.rkhs.mmd import mmd_squared_gram
from mjnav.rng import stream
from mjnav.robot.controller import build_controller
from mjnav.scene.spec import Scenario

DEGREES = (1, 2, 3)
SAMPLES, OBSTACLES = 25, 5  # the paper's
WARM_UP = 3  # decisions that are thrown away
GRAM_SAMPLES = 50  # more take hundreds of megabytes
RESAMPLES = 2000
P99 = 0.99


@dataclass(frozen=True, slots=True)
class Times:
    """How long n decisions took, one after another, with so many samples of robot and obstacles."""

    degree: int
    samples: int
    seconds: Array  # (n,)
    gram: bool = False  # by Gram matrices: a lower bound, as only they are counted

    def resampled(self) -> Array:
        """Resamples of the decisions, (RESAMPLES, n)."""
        rng = stream(self.samples, "paper.real_time.bootstrap", str(self.degree))
        return self.seconds[rng.integers(self.seconds.size, size=(RESAMPLES, self.seconds.size))]


@dataclass(frozen=True, slots=True)
class DecisionTimes:
    """Times of every size of problem; `period` [s] is the scene's."""

    period: float
    num_candidates: int
    times: tuple[Times, ...]

    def of(self, degree: int, *, gram: bool) -> list[Times]:
        """Those of a degree, by the number of samples."""
        wanted = (t for t in self.times if (t.degree, t.gram) == (degree, gram))
        return sorted(wanted, key=lambda t: t.samples)

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision that was timed."""
        return [
            {"form": "gram" if t.gram else "moments", "degree": t.degree, "samples": t.samples}
            | {"decision": i, "s": seconds}
            for t in self.times
            for i, seconds in enumerate(t.seconds.tolist())
        ]


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> DecisionTimes:
    """Of the first scenario, with more people or fewer. Raises InvalidValue for a method that is not `rkhs`."""
    scenario = scenarios[0]
    controller = build_controller(scenario)
    if not isinstance(controller, Rkhs):
        raise InvalidValue("control.method", scenario.control.method, "rkhs or rkhs-paper")
    ticks, repeat = (20, 2) if quick else (100, 3)
    sizes = (10, 25, 50) if quick else (10, 25, 50, 100, 200)
    times: list[Times] = []
    for done, samples in enumerate(sizes, 1):
        sight = {"samples": samples, "sensing_range": inf, "max_obstacles": 1_000_000}
        sized = crowd(changed(scenario, scenario.control.method, **sight), OBSTACLES)
        observations = _observations(sized, ticks)
        times += _decisions(sized, observations, repeat if samples < 100 else 1)
        if samples <= (SAMPLES if quick else GRAM_SAMPLES):
            times += _gram(sized, observations, 3 if quick or samples == GRAM_SAMPLES else 20)
        progress(done, len(sizes))
    p = controller.problem_parameters
    return DecisionTimes(scenario.control.period, p.num_v * p.num_omega + 2, tuple(times))


def _observations(scenario: Scenario, num: int) -> list[Observation]:
    """What the first ticks of a run observe."""
    observations: list[Observation] = []
    asked = count()
    Episode(scenario, watch=lambda record: observations.append(record.seen), stop=lambda: next(asked) >= num).run()
    return observations


def _decisions(scenario: Scenario, observations: Sequence[Observation], repeat: int) -> Iterator[Times]:
    """Times of all observations, `repeat` times over, by each degree in turn."""
    controllers = [build_controller(changed(scenario, scenario.control.method, degree=degree)) for degree in DEGREES]
    for controller in controllers:
        for observation in observations[:WARM_UP]:
            controller.decide(replace(observation))
    seconds: list[list[float]] = [[] for _ in DEGREES]
    for observation in [*observations] * repeat:
        for controller, taken in zip(controllers, seconds, strict=True):
            fresh = replace(observation)  # of one that it has seen, a controller knows the problem
            taken.append(_timed(lambda controller=controller, fresh=fresh: controller.decide(fresh)))
    for degree, taken in zip(DEGREES, seconds, strict=True):
        yield Times(degree, len(observations[0].robot_pose), np.array(taken))


def _timed(function: Callable[[], object]) -> float:
    began = perf_counter()
    function()
    return perf_counter() - began


def _gram(scenario: Scenario, observations: Sequence[Observation], num: int) -> Iterator[Times]:
    """Times of the Gram matrices of one candidate and obstacle, as many observations, times all of both."""
    controller = build_controller(scenario)
    assert isinstance(controller, Rkhs)
    seconds: list[list[float]] = [[] for _ in DEGREES]
    for observation in spread(observations, num):
        problem = controller.problem(observation)
        c = problem.candidates
        f = problem.cone.samples(0, c.v[:1], c.omega[:1])[:, 0]
        desired = np.append(controller.desired_cone(problem, 0), 0.0)  # never empty
        num_pairs = len(c.v) * len(problem.cone.blocks.column)
        for degree, taken in zip(DEGREES, seconds, strict=True):
            pair = _timed(lambda f=f, desired=desired, degree=degree: mmd_squared_gram(f, desired, degree=degree))
            taken.append(num_pairs * pair)
    for degree, taken in zip(DEGREES, seconds, strict=True):
        yield Times(degree, len(observations[0].robot_pose), np.array(taken), gram=True)


def claims(data: DecisionTimes) -> Iterator[Claim]:
    """Real time with the paper's number of samples, by moments and by Gram matrices."""
    for gram, how in ((False, "by moments, as here"), (True, "by Gram matrices of all pairs, as it is written")):
        slowest, p, texts = -inf, 1.0, []
        for degree in DEGREES:
            (times,) = (t for t in data.of(degree, gram=gram) if t.samples == SAMPLES)
            resampled = times.resampled()
            quantiles = np.quantile(resampled, P99, axis=1)
            median, p99 = np.quantile(times.seconds, [0.5, P99]).tolist()
            low, high = (_ms(end) for end in np.quantile(quantiles, [0.025, 0.975]))
            slow, fast = np.quantile(1.0 / resampled.mean(axis=1), [0.025, 0.975])
            if p99 > slowest:
                slowest, p = p99, bootstrap_p(quantiles, data.period)
            texts.append(
                f"d = {degree}: median {_ms(median)}, p99 {_ms(p99)} [{low}, {high}], {1.0 / times.seconds.mean():.3g} "
                f"[{slow:.3g}, {fast:.3g}] decisions a second (n = {times.seconds.size})"
            )
        yield Claim(
            f"With {SAMPLES} samples of robot and obstacles the method decides in real time, {how}.",
            "section V: 25 samples of robot and obstacle, real time",
            [Measured(slowest < data.period, p)],
            f"{OBSTACLES} obstacles, {data.num_candidates} candidates, period {_ms(data.period)}, on this machine. "
            f"{'. '.join(texts)}.",
        )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


def picture(data: DecisionTimes) -> Figure:
    """A decision's time against samples: medians, and up to the 99th percentile a line each."""
    with draw.style():
        figure = draw.new_figure(draw.TWO_COLUMNS, 2.6)
        axes = figure.subplots()
        for degree in DEGREES:
            for gram, dashes in ((False, "-"), (True, "--")):
                times = data.of(degree, gram=gram)
                sizes = [t.samples for t in times]
                median, p99 = 1e3 * np.array([np.quantile(t.seconds, [0.5, P99]) for t in times]).T
                axes.plot(sizes, median, color=draw.DEGREES[degree], linestyle=dashes, marker="o")
                axes.vlines(sizes, median, p99, color=draw.DEGREES[degree], linewidth=0.8)
        axes.axhline(1e3 * data.period, color=draw.INK, linestyle=":")
        axes.set(xscale="log", yscale="log", xlabel="samples N = M", ylabel="time of a decision [ms]")
        axes.set_title(f"{OBSTACLES} obstacles, {data.num_candidates} candidates")
        axes.set_xticks(sizes := sorted({t.samples for t in data.times}), [str(size) for size in sizes])
        axes.minorticks_off()
        axes.grid()
        handles = [Line2D([], [], color=draw.DEGREES[degree], marker="o", label=f"d = {degree}") for degree in DEGREES]
        handles += [
            Line2D([], [], color=draw.GREY, label="by moments: median, up to p99"),
            Line2D([], [], color=draw.GREY, linestyle="--", label="by Gram matrices"),
            Line2D([], [], color=draw.INK, linestyle=":", label="the control period"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


REAL_TIME = MeasuredItem(
    "Real time: decisions a second",
    ("five",),
    DIRECT,
    measure,
    claims,
    picture,
)

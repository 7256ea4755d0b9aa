"""Real time (section V): how long a decision takes, against samples, obstacles and the kernel's degree.

Runs are recorded with as many samples and people as asked, everyone in reach; then each degree in turn decides on
their observations again, in one thread. These times are compared with those of the literal form: the time of the Gram
matrices of one candidate and one obstacle, times their number. All times are of this machine and its load; processor
time leaves the load out.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from time import perf_counter, thread_time
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mjnav.control.methods.rkhs import Rkhs
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller
from mjnav.loop.realtime.stress import crowd
from mjnav.messages import Array, Observation
from mjnav.metrics.intervals import paired_bootstrap
from mjnav.paper import style
from mjnav.paper.contrast import bootstrap_p
from mjnav.paper.decisions import spread, variant
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.item import Claim, Measured, MeasuredItem, Progress
from mjnav.rkhs.mmd import mmd_squared_gram
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario

DEGREES = (1, 2, 3)
SAMPLES, OBSTACLES = 25, 5  # the paper's, and those held while the other grows
WARM_UP = 3  # decisions that are thrown away
GRAM_SAMPLES = 50  # more take hundreds of megabytes
RESAMPLES = 2000
P99 = 0.99
CPU: Mapping[str, Any] = MappingProxyType({"linestyle": "-.", "linewidth": 0.8})  # processor time
DODGE = 0.05  # of a size, between the degrees


@dataclass(frozen=True, slots=True)
class Times:
    """How long n decisions took, one after another, of one size of problem."""

    degree: int
    samples: int
    obstacles: int
    seconds: Array  # (n,)
    cpu: Array  # (n,) of the processor
    gram: bool = False  # by Gram matrices: a lower bound, as only they are counted

    def quantile(self, share: float) -> tuple[float, float, float]:
        """Of the seconds, with its 95 % bootstrap interval over decisions."""
        low, high = np.quantile(self._resampled(share), [0.025, 0.975]).tolist()
        return float(np.quantile(self.seconds, share)), low, high

    def p_value(self, share: float, boundary: float) -> float:
        """Of that quantile being the boundary [s]."""
        return bootstrap_p(self._resampled(share), boundary)

    def _resampled(self, share: float) -> Array:
        """The quantile of RESAMPLES resamples."""
        rng = stream(self.samples, "paper.real_time.bootstrap", f"{self.degree}, {self.obstacles}")
        drawn = self.seconds[rng.integers(self.seconds.size, size=(RESAMPLES, self.seconds.size))]
        return np.quantile(drawn, share, axis=1)

    def rate(self) -> tuple[float, float, float]:
        """Decisions a second, with its 95 % bootstrap interval over decisions."""
        rng = stream(self.samples, "paper.real_time.rate", f"{self.degree}, {self.obstacles}")
        low, high = paired_bootstrap(self.seconds, np.zeros_like(self.seconds), rng) or (inf, 0.0)
        return 1.0 / float(self.seconds.mean()), 1.0 / high, 1.0 / low


@dataclass(frozen=True, slots=True)
class DecisionTimes:
    """Times of every size of problem; `period` [s] is the scene's."""

    scene: str
    period: float
    num_candidates: int
    times: tuple[Times, ...]

    def of(
        self, *, degree: int, samples: int | None = None, obstacles: int | None = None, gram: bool = False
    ) -> tuple[Times, ...]:
        """Those of a degree with so many samples and obstacles, in the order of their size; None is any number."""
        return tuple(
            t
            for t in sorted(self.times, key=lambda t: (t.samples, t.obstacles))
            if t.degree == degree and t.gram == gram and t.samples == (samples or t.samples)
            and t.obstacles == (obstacles or t.obstacles)
        )  # fmt: skip

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision that was timed."""
        return [
            {"form": "gram" if t.gram else "moments", "degree": t.degree, "samples": t.samples}
            | {"obstacles": t.obstacles, "decision": i, "s": seconds, "cpu_s": cpu}
            for t in self.times
            for i, (seconds, cpu) in enumerate(zip(t.seconds.tolist(), t.cpu.tolist(), strict=True))
        ]


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> DecisionTimes:
    """Of the first scenario, with more people or fewer. Raises InvalidValue for a method that is not `rkhs`."""
    scenario = scenarios[0]
    controller = build_controller(scenario)
    if not isinstance(controller, Rkhs):
        raise InvalidValue("control.method", scenario.control.method, "rkhs or rkhs-paper")
    ticks, repeat = (20, 2) if quick else (100, 3)
    sizes = [(n, OBSTACLES) for n in ((10, 25, 50) if quick else (10, 25, 50, 100, 200))]
    sizes += [(SAMPLES, j) for j in (1, 10)]
    found: list[Times] = []
    for done, (samples, obstacles) in enumerate(sizes):
        sized = _sized(scenario, samples, obstacles)
        observations = _observations(sized, ticks)
        found += _decisions(sized, observations, repeat if samples < 100 else 1)
        if samples <= (SAMPLES if quick else GRAM_SAMPLES) and obstacles == OBSTACLES:
            found += _gram(sized, observations, 3 if quick or samples == GRAM_SAMPLES else 20)
        progress(done + 1, len(sizes))
    p = controller.problem_parameters
    return DecisionTimes(scenario.name, scenario.control.period, p.num_v * p.num_omega + 2, tuple(found))


def _sized(scenario: Scenario, samples: int, obstacles: int) -> Scenario:
    """The scenario with so many samples and people, all of them in reach."""
    sight = {"samples": samples, "sensing_range": inf, "max_obstacles": 1_000_000}
    control = replace(scenario.control, parameters={**scenario.control.parameters, **sight})
    return crowd(replace(scenario, control=control), obstacles)


def _observations(scenario: Scenario, num: int) -> list[Observation]:
    """What the first ticks of a run observe."""
    found: list[Observation] = []
    asked = count()
    Episode(scenario, watch=lambda record: found.append(record.seen), stop=lambda: next(asked) >= num).run()
    return found


def _decisions(scenario: Scenario, observations: Sequence[Observation], repeat: int) -> Iterator[Times]:
    """Times of all observations, `repeat` times over, by each degree in turn."""
    controllers = [variant(scenario, scenario.control.method, degree=degree) for degree in DEGREES]
    for controller in controllers:
        for observation in observations[:WARM_UP]:
            controller.decide(replace(observation))
    taken: list[list[tuple[float, float]]] = [[] for _ in DEGREES]
    for observation in [*observations] * repeat:
        for controller, times in zip(controllers, taken, strict=True):
            fresh = replace(observation)  # of one that it has seen, a controller knows the problem
            times.append(_timed(lambda controller=controller, fresh=fresh: controller.decide(fresh)))
    samples, obstacles = len(observations[0].robot_pose), len(observations[0].obstacles)
    for degree, times in zip(DEGREES, taken, strict=True):
        yield Times(degree, samples, obstacles, *np.array(times).T)


def _timed(function: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock, and of this thread's processor."""
    began, cpu = perf_counter(), thread_time()
    function()
    return perf_counter() - began, thread_time() - cpu


def _gram(scenario: Scenario, observations: Sequence[Observation], num: int) -> Iterator[Times]:
    """Times of the Gram matrices of one candidate and obstacle, as many observations, times all of both."""
    taken = np.empty((len(DEGREES), num, 2))
    controller = build_controller(scenario)
    assert isinstance(controller, Rkhs)
    chosen = list(spread(observations, num))
    for i in range(num):
        problem = controller.problem(chosen[i % len(chosen)])
        c = problem.candidates
        f = problem.cone.samples(0, c.v[:1], c.omega[:1])[:, 0]
        desired = np.append(controller.desired_cone(problem, 0), 0.0)  # never empty
        for d, degree in enumerate(DEGREES):
            times = _timed(lambda f=f, desired=desired, degree=degree: mmd_squared_gram(f, desired, degree=degree))
            taken[d, i] = np.array(times) * len(c.v) * len(problem.cone.blocks.column)
    samples, obstacles = len(chosen[0].robot_pose), len(chosen[0].obstacles)
    for degree, times in zip(DEGREES, taken, strict=True):
        yield Times(degree, samples, obstacles, *times.T, gram=True)


def claims(data: DecisionTimes) -> Iterator[Claim]:
    """Real time with the paper's number of samples, by moments and by Gram matrices."""
    for gram in (False, True):
        yield _claim(data, gram)


def _claim(data: DecisionTimes, gram: bool) -> Claim:
    slowest, p, texts = -inf, 1.0, []
    for degree in DEGREES:
        (times,) = data.of(degree=degree, samples=SAMPLES, obstacles=OBSTACLES, gram=gram)
        middle, (p99, low, high), (rate, slow, fast) = times.quantile(0.5)[0], times.quantile(0.99), times.rate()
        if p99 > slowest:
            slowest, p = p99, times.p_value(0.99, data.period)
        texts.append(
            f"d = {degree}: median {_ms(middle)}, p99 {_ms(p99)} [{_ms(low)}, {_ms(high)}], {rate:.3g} [{slow:.3g}, "
            f"{fast:.3g}] decisions a second (n = {times.seconds.size}); processor time p99 "
            f"{_ms(float(np.quantile(times.cpu, 0.99)))}"
        )
    how = "by Gram matrices of all pairs, as it is written" if gram else "by moments, as here"
    return Claim(
        f"With {SAMPLES} samples of robot and obstacles the method decides in real time, {how}.",
        "section V: 25 samples of robot and obstacle, real time",
        [Measured(slowest < data.period, p)],
        f"{OBSTACLES} obstacles, {data.num_candidates} candidates, period {_ms(data.period)}, on this machine. "
        f"{'. '.join(texts)}.",
    )


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


def picture(data: DecisionTimes) -> Figure:
    """A decision's time: its distribution at the paper's size, against samples, and against obstacles."""
    with style.style():
        fig = style.new_figure(style.TWO_COLUMNS, 2.6)
        shares, samples, obstacles = fig.subplots(1, 3)
        style.letter(shares, "a", f"{SAMPLES} samples, {OBSTACLES} obstacles")
        _draw_shares(shares, data)
        style.letter(samples, "b", f"{OBSTACLES} obstacles")
        style.letter(obstacles, "c", f"{SAMPLES} samples")
        for degree in DEGREES:
            of_samples = data.of(degree=degree, obstacles=OBSTACLES)
            _draw_growth(samples, of_samples, lambda t: t.samples, degree, "-")
            _draw_growth(samples, data.of(degree=degree, gram=True), lambda t: t.samples, degree, "--")
            _draw_growth(obstacles, data.of(degree=degree, samples=SAMPLES), lambda t: t.obstacles, degree, "-")
        for axes, label in ((samples, "samples N = M"), (obstacles, "obstacles")):
            axes.axhline(1e3 * data.period, color=style.INK, linewidth=0.7, linestyle=":")
            axes.set(xscale="log", yscale="log", xlabel=label, ylabel="time of a decision [ms]")
            axes.minorticks_off()
            axes.grid()
        samples.set_xticks(sorted({t.samples for t in data.times}), minor=False)
        obstacles.set_xticks(sorted({t.obstacles for t in data.times}), minor=False)
        for axes in (samples, obstacles):
            axes.set_xticklabels([f"{tick:g}" for tick in axes.get_xticks()])
        _legend(fig)
    return fig


def _draw_shares(axes: Axes, data: DecisionTimes) -> None:
    for degree in DEGREES:
        for times in data.of(degree=degree, samples=SAMPLES, obstacles=OBSTACLES):
            axes.ecdf(1e3 * times.seconds, color=style.DEGREES[degree])
            axes.ecdf(1e3 * times.cpu, color=style.DEGREES[degree], **CPU)
    axes.axhline(P99, color=style.GREY, linewidth=0.5)
    axes.annotate("99 %", (1.0, P99), xycoords=axes.get_yaxis_transform(), ha="right", va="top", color=style.GREY)
    axes.set(xscale="log", xlabel="time of a decision [ms]", ylabel="share of decisions", ylim=(0.0, 1.02))
    axes.grid(which="both", axis="x")


def _draw_growth(axes: Axes, times: Sequence[Times], size: Callable[[Times], int], degree: int, dashes: str) -> None:
    """Medians, and up to the 99th percentile a line each."""
    if not times:
        return
    sizes = [size(t) * (1.0 + DODGE * (degree - 2)) for t in times]
    middle, p99 = (1e3 * np.array([np.quantile(t.seconds, share) for t in times]) for share in (0.5, P99))
    axes.plot(sizes, middle, color=style.DEGREES[degree], linestyle=dashes, marker="o")
    axes.vlines(sizes, middle, p99, color=style.DEGREES[degree], linewidth=0.8)


def _legend(fig: Figure) -> None:
    handles = [Line2D([], [], color=style.DEGREES[degree], marker="o", label=f"d = {degree}") for degree in DEGREES]
    handles += [
        Line2D([], [], color=style.GREY, label="by moments: median, up to p99"),
        Line2D([], [], color=style.GREY, linestyle="--", label="by Gram matrices"),
        Line2D([], [], color=style.GREY, label="processor time", **CPU),
        Line2D([], [], color=style.INK, linestyle=":", linewidth=0.7, label="the control period"),
    ]
    fig.legend(handles=handles, loc="outside lower center", ncols=7, columnspacing=1.2)


ITEM = MeasuredItem(
    title="Real time: decisions a second",
    scenes=("five",),
    overrides=options(DIRECT),
    measure=measure,
    claims=claims,
    picture=picture,
)

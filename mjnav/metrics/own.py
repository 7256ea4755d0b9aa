"""Metrics of a user's own: figures of a run beside mjnav's, from memory and from a log alike."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from numbers import Real
from typing import Any, Protocol

from mjnav.errors import InvalidValue, PluginFault, own_code, said
from mjnav.messages import Trajectory
from mjnav.scene.plugged import plugins_of
from mjnav.scene.spec import Scenario
from mjnav.sealed import sealed_message
from mjnav.settings.plugins import MetricPlugin


@dataclass(frozen=True, slots=True)
class Figure:
    """What a figure is: its unit, "" for a plain number, and a sentence."""

    unit: str
    text: str


class Metric(Protocol):
    """Figures of a run: made as Class(), or as Class(parameters) where it has a `parameters_type`.

    A metric is pure: the same trajectory and scenario give the same figures, whether they come from memory or a log.
    """

    figures: Mapping[str, Figure]  # by name, each an identifier

    def measure(self, trajectory: Trajectory, scenario: Scenario) -> Mapping[str, float | None]:
        """A value for each of `figures`; None where it is undefined. The arrays cannot be written to."""
        ...


@dataclass(frozen=True, slots=True)
class Measured:
    """What a run's own metrics found: a value for each figure, None where it is undefined or a metric failed."""

    figures: Mapping[str, Figure] = field(default_factory=dict)
    values: Mapping[str, float | None] = field(default_factory=dict)
    faults: tuple[str, ...] = ()  # a line for each metric or value that could not be used


class OwnMetrics:
    """The metrics that a scenario names, each made once. Raises InvalidValue for what is none."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._metrics: list[tuple[str, Any]] = []
        self.figures: Mapping[str, Figure] = {}
        metrics = {key: plugin for key, plugin in plugins_of(scenario).items() if isinstance(plugin, MetricPlugin)}
        for key, plugin in metrics.items():
            try:
                metric = plugin.make()
                self.figures = {**self.figures, **_figures(plugin, metric, self.figures)}
            except InvalidValue as error:
                raise error.within(key, file=scenario.source or None) from None
            self._metrics.append((plugin.name, metric))

    def measured(self, trajectory: Trajectory) -> Measured:
        """The figures of a run, or of as much of it as there is."""
        if not self._metrics:
            return Measured()
        trajectory = sealed_message(trajectory)
        found: dict[str, float | None] = {}
        faults: list[str] = []
        for name, metric in self._metrics:
            try:
                with PluginFault.told(name, "measure()"):
                    values = metric.measure(trajectory, self._scenario)
                    if not isinstance(values, Mapping):
                        raise PluginFault(f"{name}: measure() returned {values!r:.60} in place of a mapping")
                    faults += _misfits(name, values, metric.figures)
                    found |= {figure: _number(values.get(figure)) for figure in metric.figures}
            except PluginFault as fault:
                faults.append(str(fault))
        return Measured(self.figures, {name: found.get(name) for name in self.figures}, tuple(faults))


def _figures(plugin: MetricPlugin, metric: Any, known: Mapping[str, Figure]) -> Mapping[str, Figure]:
    """The figures of a metric. Raises InvalidValue for what are none, and for names that another metric has."""
    with own_code(lambda error: InvalidValue("", plugin.name, f"a metric whose `figures` can be read ({said(error)})")):
        figures = getattr(metric, "figures", None)
    if not isinstance(figures, Mapping) or not all(
        isinstance(name, str) and name.isidentifier() and isinstance(figure, Figure) for name, figure in figures.items()
    ):
        allowed = "a metric whose `figures` are a mapping from names to mjnav.metrics.Figure(unit, text)"
        raise InvalidValue("", plugin.name, allowed)
    for name in figures:
        if name in known:
            raise InvalidValue("", plugin.name, f"metrics whose figures have different names: two have {name!r}")
    return figures


def _misfits(name: str, values: Mapping[object, object], figures: Mapping[str, Figure]) -> Iterator[str]:
    """What is wrong with the values of a metric, in words."""
    for figure in figures:
        if figure not in values:
            yield f"{name}: measure() returned no {figure}"
        elif values[figure] is not None and _number(values[figure]) is None:
            yield f"{name}: measure() returned {figure} = {values[figure]!r:.60}, which is no finite number"
    for other in values:
        if other not in figures:
            yield f"{name}: measure() returned {other!r:.60}, which is not among its figures"


def _number(value: object) -> float | None:
    """A value as a finite float, or None."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        number = float(value)
    except (OverflowError, ValueError, TypeError):
        return None
    return number if isfinite(number) else None

"""Figures of several models over the same predictions, with intervals. The unit is the person.

Predictions of one person at neighbouring moments say nearly the same: a person's predictions are averaged first, and
the intervals are those of a mean over people (bootstrap, the same people drawn for every figure).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, SharedBootstrap
from mjnav.metrics.prediction import LEVELS
from mjnav.rng import stream
from mjnav.study.prediction.forecast import Forecast

FIGURES = ("ade_m", "fde_m", "min_ade_m", "energy_m", *(f"inside_{100 * level:g}" for level in LEVELS))
BY_HORIZON = ("error_m", "energy_m", *(f"inside_{100 * level:g}" for level in LEVELS))


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """The figures of one model: a mean over people, and its interval at 95 %; one person's figures have none."""

    people: int
    predictions: int
    figures: Mapping[str, tuple[float | None, Interval]]  # of FIGURES; means over the predicted times, but fde_m
    beyond_first: tuple[float | None, Interval]  # energy_m less that of the first model, person by person
    by_window: tuple[float | None, float | None]  # ADE and FDE [m] as means over predictions, as others publish them
    by_horizon: Mapping[str, tuple[tuple[float | None, Interval], ...]]  # of BY_HORIZON, at each predicted time


def model_figures(found: Mapping[str, Sequence[Forecast]]) -> dict[str, ModelFigures]:
    """The figures of each model, by name. Every model has predicted the same people at the same moments."""
    people = sorted({forecast.person for forecasts in found.values() for forecast in forecasts})
    if not people:
        return {name: ModelFigures(0, 0, {}, (None, None), (None, None), {}) for name in found}
    bootstrap = SharedBootstrap(len(people), stream(0, "prediction.bootstrap"), resamples=2000)
    first = next(iter(found.values()))
    return {name: _figures(forecasts, first, people, bootstrap) for name, forecasts in found.items()}


def _figures(
    forecasts: Sequence[Forecast], first: Sequence[Forecast], people: Sequence[str], bootstrap: SharedBootstrap
) -> ModelFigures:
    place = {person: i for i, person in enumerate(people)}
    unit = np.array([place[forecast.person] for forecast in forecasts])
    scores = [forecast.scores for forecast in forecasts]
    inside = np.array([s.inside for s in scores])  # (n, H, L)
    series = {"error_m": np.array([s.error for s in scores]), "energy_m": np.array([s.energy for s in scores])}
    series |= {f"inside_{100 * level:g}": inside[:, :, i] for i, level in enumerate(LEVELS)}
    whole = {
        "ade_m": series["error_m"].mean(axis=1),
        "fde_m": series["error_m"][:, -1],
        "min_ade_m": np.array([s.min_ade for s in scores]),
        **{name: values.mean(axis=1) for name, values in series.items() if name != "error_m"},
    }
    count = np.bincount(unit, minlength=len(people))

    def means(values: Array) -> list[tuple[float | None, Interval]]:
        """Of values (n, F): a mean over people for each column."""
        sums = np.zeros((len(people), values.shape[1]))
        np.add.at(sums, unit, values)
        by_person = (sums / count[:, None]).T
        averages = by_person.mean(axis=1)
        intervals = bootstrap.intervals(by_person) if len(people) > 1 else [None] * len(averages)
        return [
            (float(average) if np.isfinite(average) else None, interval)
            for average, interval in zip(averages, intervals, strict=True)
        ]

    energy_of_first = np.array([forecast.scores.energy.mean() for forecast in first])
    (beyond_first,) = means((whole["energy_m"] - energy_of_first)[:, None])
    figures = dict(zip(FIGURES, means(np.column_stack([whole[name] for name in FIGURES])), strict=True))
    return ModelFigures(
        people=len(people),
        predictions=len(forecasts),
        figures=figures,
        beyond_first=beyond_first,
        by_window=(float(whole["ade_m"].mean()), float(whole["fde_m"].mean())),
        by_horizon={name: tuple(means(series[name])) for name in BY_HORIZON},
    )

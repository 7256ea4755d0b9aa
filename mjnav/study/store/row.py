"""One episode as a row: every column of the store with its type and meaning, the same for all studies.

A figure that is undefined is null. A failed episode has no figures; its `error` says why.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from mjnav.loop.provenance.facts import FACTS

ROW_SCHEMA = 2  # version of these columns; rows of version 1 do not have it

STRING, INTEGER, NUMBER, TRUTH = "string", "int64", "double", "bool"

Value = str | int | float | bool | None


class Column(NamedTuple):
    """The type of a column, as Arrow calls it, and what it holds. A unit stands at the end of the column's name."""

    type: str
    text: str


def _columns(**columns: tuple[str, str]) -> Mapping[str, Column]:
    return MappingProxyType({name: Column(*column) for name, column in columns.items()})


LABELS = _columns(
    id=(STRING, "hash of the labels, the scenario, the parameters, the seed and all facts that decide the bits"),
    study=(STRING, "name in the study file"),
    scene=(STRING, "name of the scene"),
    setting=(STRING, "name of the setting and swept values of the study's grid; default without either"),
    method=(STRING, "name of the method and its swept values"),
    seed=(INTEGER, "seed of the episode"),
    controller=(STRING, "control.method"),
    parameters=(STRING, 'swept values by key as JSON: {"control.weight": 0.3}'),
    control=(STRING, "every parameter of the controller with its value, as JSON"),
    scenario=(STRING, "the run file with all defaults; `mjnav run` repeats the episode from it and the seed"),
)
FIGURES = _columns(
    error=(STRING, "why there is no result, in a line; null where there is one"),
    outcome=(STRING, "goal, collision, timeout or aborted"),
    success=(TRUTH, "the goal was reached in time without contact"),
    **{f"collisions_{kind}": (INTEGER, f"contacts with a {kind}") for kind in ("person", "table", "wall", "pillar")},
    lane_violation_s=(NUMBER, "time beyond a lane's boundary; null without lanes"),
    min_lane_clearance_m=(NUMBER, "from the robot's edge to the nearer boundary, minimum; null without lanes"),
    mean_lane_clearance_m=(NUMBER, "from the robot's edge to the nearer boundary, mean over time; null without lanes"),
    time_s=(NUMBER, "simulated time from the start to the end of the run"),
    path_length_m=(NUMBER, "length of the driven path"),
    straight_line_m=(NUMBER, "length of the polyline from the start over the waypoints to the goal"),
    path_ratio=(NUMBER, "path_length_m / straight_line_m"),
    mean_deviation_m=(
        NUMBER,
        "lateral distance from the polyline of start, waypoints and goal, mean over time",
    ),
    max_deviation_m=(NUMBER, "lateral distance from the polyline of start, waypoints and goal, maximum"),
    control_cost=(NUMBER, "sum of (dv^2 + (track_width/2)^2 domega^2)/dt over the commands, from rest [m^2/s^3]"),
    min_clearance_m=(NUMBER, "least distance of the robot's surface from any other; null in an empty room"),
    time_to_avoid_s=(NUMBER, "from the first to the last time that the nominal control leaves the polyline"),
    ticks=(INTEGER, "decisions"),
    infeasible_ticks=(INTEGER, "sum of the next two"),
    ticks_without_nominal=(INTEGER, "status infeasible_nominal: nothing met the constraints at the mean"),
    ticks_without_own=(INTEGER, "status infeasible: nothing met the method's own constraint"),
    stopped_ticks=(INTEGER, "status stopped"),
    clipped_ticks=(INTEGER, "ticks whose decision was beyond the robot's limits"),
    localization_rmse_m=(NUMBER, "error of the robot's estimated position, root of the mean square"),
    tracking_rmse_m=(
        NUMBER,
        "error of people's estimated positions, root of the mean square; null where nobody was tracked",
    ),
    robot_skew=(NUMBER, "of the robot samples' x and y that the controller got"),
    robot_kurtosis=(NUMBER, "of the same samples; 3 for a Gaussian"),
    people_skew=(NUMBER, "the same of people's samples; null without people"),
    people_kurtosis=(NUMBER, "the same of people's samples; null without people"),
    min_safe_share=(NUMBER, "of the closest obstacle's samples at the chosen control, minimum over ticks"),
    mean_safe_share=(NUMBER, "mean over ticks; null where the method never met an obstacle"),
    **{
        f"compute_ms_{phase}_{level}": (NUMBER, "wall time of a tick's phase")
        for phase in ("sense", "estimate", "control", "record", "tick")
        for level in ("p50", "p99", "max")
    },
    real_time_factor=(NUMBER, "simulated time / wall time"),
    deadline_misses=(INTEGER, "ticks that ended after their deadline; 0 where the run was not paced"),
    state_hash=(STRING, "hash of all states and decisions: equal where two episodes were the same"),
)
OWN = _columns(
    metrics=(STRING, "figures of the user's own metrics by name, as JSON; null where the scenario names none"),
)
ORIGIN = _columns(
    wall_s=(NUMBER, "wall time of the episode"),
    machine=(STRING, "host name"),
    revision=(STRING, "mjnav's version and git revision"),
    log=(STRING, "the episode's log as a path from the results' folder, logs/NAME.mcap; null where none was kept"),
)
# What decides an episode's bits beside its labels: column -> the fact of `loop.provenance` that it holds.
MADE_WITH: Mapping[str, str] = MappingProxyType({fact.replace(".", "_"): fact for fact in FACTS})
COLUMNS: Mapping[str, Column] = MappingProxyType(
    {
        **LABELS,
        **FIGURES,
        **OWN,
        **ORIGIN,
        "row_schema": Column(INTEGER, "version of these columns"),
        **{column: Column(STRING, FACTS[fact][1]) for column, fact in MADE_WITH.items()},
    }
)
CELL = ("study", "scene", "setting", "method")  # the labels that all rows of a cell share
PLACE_IN_STUDY = (*CELL, "seed")  # the labels of one episode


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode, on its way from the process that ran it to the store. `LABELS` and `ORIGIN` describe the fields."""

    id: str
    study: str
    scene: str
    setting: str
    method: str
    seed: int
    controller: str
    parameters: str
    control: str
    scenario: str
    machine: str
    revision: str
    wall_s: float | None
    made_with: Mapping[str, str]  # by fact of `loop.provenance`
    figures: Mapping[str, Value]  # by column of `FIGURES`; empty where there is an error
    error: str | None = None
    log: str | None = None
    metrics: str | None = None

    def values(self) -> dict[str, Value]:
        """The value of each of `COLUMNS`."""
        fields = {name: getattr(self, name) for name in (*LABELS, *OWN, *ORIGIN, "error")}
        facts = {column: self.made_with.get(fact) for column, fact in MADE_WITH.items()}
        return dict.fromkeys(COLUMNS) | dict(self.figures) | fields | facts | {"row_schema": ROW_SCHEMA}

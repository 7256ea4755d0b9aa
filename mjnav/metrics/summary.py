"""One run's figures under the names that `mjnav run --json` gives them."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite

import numpy as np

from mjnav.messages import Trajectory
from mjnav.metrics import consistency, effort, progress, safety, social
from mjnav.metrics import consistency as kidnapping
from mjnav.metrics import effort as kinematics
from mjnav.metrics import progress as arrival
from mjnav.metrics import safety as fault
from mjnav.metrics import social as proximity
from mjnav.metrics import tracking as gospa
from mjnav.metrics import tracking as identity
from mjnav.scene.check import is_avoidable
from mjnav.scene.spec import Scenario

INFEASIBLE = ("infeasible_nominal", "infeasible")


@dataclass(frozen=True, slots=True)
class Figures:
    """What follows from a trajectory: `metrics.definitions` says what each is. Undefined or not finite is None."""

    outcome: str | None
    success: bool
    timeout: bool
    collisions: Mapping[str, int]  # by the kind of what was touched
    collisions_moving: int
    collisions_at_rest: int
    robot_at_fault: int
    people_see_robot: str | None
    layout: str | None
    avoidable_start: bool
    lane_violation_s: float | None
    time_s: float
    aggregated_time_s: float | None
    failures_to_progress: int
    path_length_m: float | None
    straight_line_m: float | None
    path_ratio: float | None
    spl: float | None
    mean_deviation_m: float | None
    max_deviation_m: float | None
    control_cost: float | None
    min_clearance_m: float | None
    min_obstacle_clearance_m: float | None
    mean_obstacle_clearance_m: float | None
    min_human_distance_m: float | None
    mean_human_distance_m: float | None
    space_compliance: float | None
    intimate_space_share: float | None
    personal_space_share: float | None
    social_space_share: float | None
    min_time_to_collision_s: float | None
    social_force_on_people_m_s: float | None
    social_force_on_robot_m_s: float | None
    social_work_m_s: float | None
    min_speed_m_s: float | None
    mean_speed_m_s: float | None
    max_speed_m_s: float | None
    min_acceleration_m_s2: float | None
    mean_acceleration_m_s2: float | None
    max_acceleration_m_s2: float | None
    min_jerk_m_s3: float | None
    mean_jerk_m_s3: float | None
    max_jerk_m_s3: float | None
    stalled_s: float | None
    not_moving_s: float | None
    heading_change_rad: float | None
    ticks: int
    infeasible_ticks: int
    clipped_ticks: int
    cautious_ticks: int
    localization_rmse_m: float | None
    tracking_rmse_m: float | None
    seen_tracking_rmse_m: float | None
    gospa_m: float | None
    gospa_localization_m: float | None
    gospa_missed_m: float | None
    gospa_false_m: float | None
    identity_switches: int | None
    track_fragmentations: int | None
    false_tracks: float | None
    tracked_share: float | None
    first_track_delay_s: float | None
    robot_nees: float | None
    people_nees: float | None
    robot_coverage: float | None
    people_coverage: float | None
    robot_divergences: int
    people_divergences: int
    ess_min: Mapping[str, float | None]  # of the robot's belief, and of people's
    ess_mean: Mapping[str, float | None]
    robot_depleted_share: float | None
    people_depleted_share: float | None
    recoveries: int
    kidnappings: int | None
    kidnappings_recovered: int | None
    kidnap_recovery_s: float | None


def summarise(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> Figures:
    """The figures of a run that ended with `outcome`, or goes on."""
    collisions = safety.collisions(trajectory.contacts, scenario.control.period)
    success = outcome == "goal" and not any(collisions.values())
    with np.errstate(invalid="ignore", over="ignore"):  # where the physics broke, figures are None
        figures = {
            **_path(trajectory, scenario, success=success),
            **_near(trajectory, scenario),
            **_motion(trajectory, scenario),
            "aggregated_time_s": arrival.aggregated_time(trajectory, scenario, outcome=outcome),
            **_knowledge(trajectory, scenario),
        }
        robot, people = consistency.of_robot(trajectory), consistency.of_people(trajectory)
        kept = identity.identity(trajectory, scenario)
        kidnapped = kidnapping.recoveries(trajectory, scenario)
    ess = {"robot": trajectory.robot_ess, "people": trajectory.people_ess}
    touches = fault.touches(trajectory, scenario)
    return Figures(
        outcome=outcome,
        success=success,
        timeout=outcome == "timeout",
        collisions=collisions,
        collisions_moving=sum(touch.moving for touch in touches),
        collisions_at_rest=sum(not touch.moving for touch in touches),
        robot_at_fault=sum(touch.at_fault for touch in touches),
        people_see_robot=fault.people_see_robot(scenario),
        layout=None if scenario.layout is None else scenario.layout.label,
        avoidable_start=is_avoidable(scenario),
        time_s=round(float(trajectory.time[-1] - trajectory.time[0]), 9),  # sums of periods have rounding errors
        failures_to_progress=progress.failures_to_progress(trajectory, scenario),
        ticks=len(trajectory.status),
        infeasible_ticks=sum(status in INFEASIBLE for status in trajectory.status),
        clipped_ticks=trajectory.clipped_ticks,
        cautious_ticks=trajectory.cautious_ticks,
        kidnappings=kidnapped and len(kidnapped.times),
        kidnappings_recovered=kidnapped and kidnapped.recovered,
        kidnap_recovery_s=kidnapped and kidnapped.longest,
        identity_switches=kept and kept.switches,
        track_fragmentations=kept and kept.fragmentations,
        false_tracks=kept and kept.false_tracks,
        tracked_share=kept and kept.tracked_share,
        first_track_delay_s=kept and kept.first_track_delay,
        robot_nees=_finite(robot.nees),
        people_nees=_finite(people.nees),
        robot_coverage=robot.coverage,
        people_coverage=people.coverage,
        robot_divergences=robot.divergences,
        people_divergences=people.divergences,
        ess_min={name: consistency.least(values) for name, values in ess.items()},
        ess_mean={name: consistency.mean(values) for name, values in ess.items()},
        recoveries=trajectory.recoveries,
        **{name: _finite(value) for name, value in figures.items()},
    )


def _path(trajectory: Trajectory, scenario: Scenario, *, success: bool) -> dict[str, float | None]:
    mean_deviation, max_deviation = progress.deviation(trajectory, scenario)
    return {
        "path_length_m": progress.path_length(trajectory),
        "straight_line_m": progress.length(progress.way(scenario)),
        "path_ratio": progress.path_ratio(trajectory, scenario),
        "spl": progress.spl(trajectory, scenario, success=success),
        "mean_deviation_m": mean_deviation,
        "max_deviation_m": max_deviation,
        "lane_violation_s": safety.lane_violation(trajectory, scenario),
    }


def _near(trajectory: Trajectory, scenario: Scenario) -> dict[str, float | None]:
    clearances = safety.clearances(trajectory, scenario)
    found = proximity.proximity(trajectory, scenario)
    forces = social.social_forces(trajectory, scenario)
    return {
        "min_clearance_m": clearances.least,
        "min_obstacle_clearance_m": clearances.least_thing,
        "mean_obstacle_clearance_m": clearances.mean_thing,
        "min_human_distance_m": clearances.least_person,
        "mean_human_distance_m": found and found.mean_distance,
        "space_compliance": found and found.compliance,
        "intimate_space_share": found and found.intimate,
        "personal_space_share": found and found.personal,
        "social_space_share": found and found.social,
        "min_time_to_collision_s": proximity.min_time_to_collision(trajectory, scenario),
        "social_force_on_people_m_s": forces and forces.on_people,
        "social_force_on_robot_m_s": forces and forces.on_robot,
        "social_work_m_s": forces and forces.work,
    }


def _motion(trajectory: Trajectory, scenario: Scenario) -> dict[str, float | None]:
    quantities = {
        "speed_m_s": kinematics.velocity(trajectory),
        "acceleration_m_s2": kinematics.acceleration(trajectory),
        "jerk_m_s3": kinematics.jerk(trajectory),
    }
    found = {name: asdict(kinematics.extremes(vectors)) for name, vectors in quantities.items()}
    return {
        **{f"{part}_{name}": value for name, values in found.items() for part, value in values.items()},
        "control_cost": effort.control_cost(trajectory.command, scenario.control.period),
        "stalled_s": kinematics.stalled_time(trajectory),
        "not_moving_s": kinematics.time_not_moving(trajectory),
        "heading_change_rad": kinematics.heading_change(trajectory),
    }


def _knowledge(trajectory: Trajectory, scenario: Scenario) -> dict[str, float | None]:
    found = gospa.gospa(trajectory, scenario)
    particles = consistency.robot_particles(trajectory, scenario), scenario.estimation.obstacles.particles
    return {
        "localization_rmse_m": consistency.localization_rmse(trajectory),
        "tracking_rmse_m": consistency.tracking_rmse(trajectory),
        "seen_tracking_rmse_m": consistency.seen_tracking_rmse(trajectory),
        "gospa_m": found and found.total,
        "gospa_localization_m": found and found.localization,
        "gospa_missed_m": found and found.missed,
        "gospa_false_m": found and found.false,
        "robot_depleted_share": consistency.depleted_share(trajectory.robot_ess, particles[0]),
        "people_depleted_share": consistency.depleted_share(trajectory.people_ess, particles[1]),
    }


def _finite(figure: float | None) -> float | None:
    return figure if figure is not None and isfinite(figure) else None

from dataclasses import replace

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.log.encode.candidates import (
    NUM_CORNERS,
    PREVIEW,
    RESOLUTION,
    candidates_schema,
    chosen_candidate,
    cone_schema,
    encode_arcs,
    encode_candidates,
    encode_cone,
)
from mjnav.messages import ConeDistribution
from mjnav.motion.unicycle import integrate
from tests.log.conftest import message_class


def logged(record):
    """What the log says of the candidates of a tick, by the schema that it carries."""
    data = encode_candidates(record.belief.mean, record.decision, record.decision.costs)
    return message_class(candidates_schema()).FromString(data)


def with_costs(record, **changes):
    return replace(record, decision=replace(record.decision, costs=replace(record.decision.costs, **changes)))


@pytest.mark.parametrize("num_candidates", [1, 402])
def test_every_candidate_reads_back_with_each_term_of_its_cost(made_up, num_candidates):
    made_up.num_candidates = num_candidates
    record = made_up.record(0)
    costs = record.decision.costs
    cone = costs.cone.copy()
    cone[:, 2] = 0.0
    found = logged(with_costs(record, cone=cone))
    for exact in ("v", "omega", "nominal"):
        np.testing.assert_array_equal(getattr(found, exact), getattr(costs, exact))
    lanes = {"lane_left": costs.lane[:, 0], "lane_right": costs.lane[:, 1]}
    for name, values in {"goal": costs.goal, **lanes, "total": costs.total}.items():
        np.testing.assert_array_equal(getattr(found, name), values.astype("f4"))
    columns = [list(column.values) or [0.0] * num_candidates for column in found.cone]
    np.testing.assert_array_equal(np.transpose(columns), cone.astype("f4"))
    np.testing.assert_array_equal(found.pose, record.belief.mean)
    assert (*found.decision,) == (record.decision.v, record.decision.omega)
    assert found.chosen == int(np.argmin(costs.total))


def test_costs_that_are_not_finite_or_too_large_for_a_float32_read_back_as_such(made_up):
    record = made_up.record(0)
    total = record.decision.costs.total.copy()
    total[:4] = np.inf, np.nan, 1e300, -1e300
    found = logged(with_costs(record, total=total))
    np.testing.assert_array_equal(found.total[:4], [np.inf, np.nan, np.inf, -np.inf])


def test_the_chosen_candidate_is_the_cheapest_with_the_control_that_was_wished_for(made_up):
    decision = made_up.record(0).decision
    costs = replace(decision.costs, v=np.array([0.5, 0.5, 0.2]), omega=np.zeros(3), total=np.array([2.0, 1.0, 0.0]))
    assert chosen_candidate(replace(decision, v=0.5, omega=0.0, costs=costs)) == 1
    assert chosen_candidate(replace(decision, v=0.2, omega=0.0, wish=(0.5, 0.0), costs=costs)) == 1
    assert chosen_candidate(replace(decision, v=0.3, omega=0.0, costs=costs)) is None
    assert chosen_candidate(replace(decision, costs=None)) is None


def test_the_cone_distribution_reads_back_through_its_own_schema():
    samples, desired = np.linspace(-3.0, 1.0, 625), np.linspace(-2.0, 0.0, 17)
    data = encode_cone(ConeDistribution("person4", samples, desired, 0.1 + 0.2))
    message = message_class(cone_schema()).FromString(data)
    assert (message.obstacle, message.safe_share) == ("person4", 0.1 + 0.2)
    np.testing.assert_array_equal(np.array(message.samples, "f4"), samples.astype("f4"))
    np.testing.assert_array_equal(np.array(message.desired, "f4"), desired.astype("f4"))


# ----------------------------------------------------------------------------------------------- arcs


def arcs(line) -> np.ndarray:
    """Corners of each arc with its start, (n, 1 + NUM_CORNERS, 2), as a reader of the indices draws them."""
    points = np.array([(p.x, p.y) for p in line.points])
    segments = points[np.array(line.indices)].reshape(-1, NUM_CORNERS, 2, 2)
    np.testing.assert_array_equal(segments[:, 1:, 0], segments[:, :-1, 1])  # each begins where the last ended
    return np.concatenate([segments[:, :1, 0], segments[:, :, 1]], axis=1)


def drawn(record, **changes):
    decision = record.decision
    costs = replace(decision.costs, **changes)
    data = encode_arcs(record.truth.time, record.belief.mean, (decision.v, decision.omega), costs)
    (entity,) = SceneUpdate.FromString(data).entities
    return entity


@pytest.mark.parametrize("num_candidates", [1, 3, 17, 402])
def test_every_candidate_is_drawn_once_and_the_chosen_one_bold(made_up, num_candidates):
    made_up.num_candidates = num_candidates
    record = made_up.record(0)
    costs = record.decision.costs
    *thin, bold = drawn(record).lines
    lines = np.concatenate([arcs(line) for line in thin])
    assert len(lines) == num_candidates
    order = np.argsort(costs.total)
    end = integrate(record.belief.mean, costs.v[order], costs.omega[order], PREVIEW)
    np.testing.assert_allclose(lines[:, -1], end[:, :2], atol=RESOLUTION)
    np.testing.assert_allclose(lines[:, 0] - record.belief.mean[:2], 0.0, atol=RESOLUTION)
    np.testing.assert_array_equal(arcs(bold)[0], lines[0])
    assert bold.thickness > 5 * thin[0].thickness


def test_cheap_candidates_are_green_and_dear_ones_red(made_up):
    *thin, _ = drawn(made_up.record(0)).lines
    greenness = [line.color.g - line.color.r for line in thin]
    assert greenness == sorted(greenness, reverse=True)
    assert greenness[0] > 0 > greenness[-1]

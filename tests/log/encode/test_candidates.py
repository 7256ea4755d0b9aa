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
    decode_candidates,
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
    return decode_candidates(message_class(candidates_schema()).FromString(data))


def with_costs(record, **changes):
    return replace(record, decision=replace(record.decision, costs=replace(record.decision.costs, **changes)))


@pytest.mark.parametrize("num_candidates", [1, 402])
def test_every_candidate_reads_back_with_each_term_of_its_cost(made_up, num_candidates):
    made_up.num_candidates = num_candidates
    record = made_up.record(0)
    costs = record.decision.costs
    cone = costs.cone.copy()
    cone[:, 2] = 0.0
    total = costs.total.copy()
    total[1:5] = [np.inf, np.nan, 1e300, -1e300][: num_candidates - 1]  # the last two are beyond a float32
    found = logged(with_costs(record, cone=cone, total=total))
    for exact in ("v", "omega", "nominal"):
        np.testing.assert_array_equal(getattr(found.costs, exact), getattr(costs, exact))
    for name, values in (("goal", costs.goal), ("cone", cone), ("lane", costs.lane), ("total", total)):
        with np.errstate(over="ignore"):
            np.testing.assert_array_equal(getattr(found.costs, name), values.astype("f4"))
    np.testing.assert_array_equal(found.pose, record.belief.mean)
    assert (*found.decision,) == (record.decision.v, record.decision.omega)
    assert found.chosen == int(np.argmin(costs.total))


def test_the_chosen_candidate_is_the_cheapest_with_the_control_that_was_wished_for(made_up):
    decision = made_up.record(0).decision
    costs = replace(decision.costs, v=np.array([0.5, 0.5, 0.2]), omega=np.zeros(3), total=np.array([2.0, 1.0, 0.0]))
    assert chosen_candidate(replace(decision, v=0.5, omega=0.0, costs=costs)) == 1
    assert chosen_candidate(replace(decision, v=0.2, omega=0.0, wish=(0.5, 0.0), costs=costs)) == 1
    assert chosen_candidate(replace(decision, v=0.3, omega=0.0, costs=costs)) is None
    assert chosen_candidate(replace(decision, costs=None)) is None


def test_arrays_that_differ_in_length_or_columns_by_the_million_are_refused(made_up):
    record = made_up.record(0)
    data = encode_candidates(record.belief.mean, record.decision, record.decision.costs)
    decode = message_class(candidates_schema()).FromString
    with pytest.raises(ValueError, match="differ in length"):
        decode_candidates(decode(data + b"\x4a\x04\x00\x00\x80\x3f"))  # one more total
    with pytest.raises(ValueError, match="402 candidates with 50007 constraints"):
        decode_candidates(decode(data + b"\x32\x00" * 50_000))


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

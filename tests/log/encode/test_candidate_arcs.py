from dataclasses import replace

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjnav.log.encode.candidates import NUM_CORNERS, PREVIEW, RESOLUTION, encode_arcs
from mjnav.motion.unicycle import integrate


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


def test_candidates_of_infinite_cost_are_drawn(made_up):
    record = made_up.record(0)
    costs = record.decision.costs
    *thin, _ = drawn(record, total=np.where(costs.v > 0.5, np.inf, costs.total)).lines
    assert sum(len(arcs(line)) for line in thin) == 402

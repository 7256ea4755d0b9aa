from dataclasses import replace

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from mjnav.messages import ConeDistribution
from mjnav.motion.unicycle import integrate
from mjnav.recording.encode import candidates


def arcs(line) -> np.ndarray:
    """Corners of each arc with its start, (n, 1 + NUM_CORNERS, 2), as a reader of the indices draws them."""
    points = np.array([(p.x, p.y) for p in line.points])
    segments = points[np.array(line.indices)].reshape(-1, candidates.NUM_CORNERS, 2, 2)
    np.testing.assert_array_equal(segments[:, 1:, 0], segments[:, :-1, 1])  # each begins where the last ended
    return np.concatenate([segments[:, :1, 0], segments[:, :, 1]], axis=1)


def encode(record):
    update = SceneUpdate.FromString(
        candidates.encode_candidates(record.truth.time, record.belief.mean, record.decision, record.decision.costs)
    )
    (entity,) = update.entities
    return entity


@pytest.mark.parametrize("num_candidates", [1, 3, 16, 17, 402])
def test_every_candidate_is_drawn_once_and_the_chosen_one_bold(made_up, num_candidates):
    made_up.num_candidates = num_candidates
    record = made_up.record(0)
    costs = record.decision.costs
    *thin, bold = encode(record).lines
    drawn = np.concatenate([arcs(line) for line in thin])
    assert len(drawn) == num_candidates
    order = np.argsort(costs.total)
    end = integrate(record.belief.mean, costs.v[order], costs.omega[order], candidates.PREVIEW)
    np.testing.assert_allclose(drawn[:, -1], end[:, :2], atol=candidates.RESOLUTION)
    np.testing.assert_allclose(drawn[:, 0] - record.belief.mean[:2], 0.0, atol=candidates.RESOLUTION)
    np.testing.assert_array_equal(arcs(bold)[0], drawn[0])
    assert bold.thickness > 5 * thin[0].thickness


def test_cheap_candidates_are_green_and_dear_ones_red(made_up):
    *thin, _ = encode(made_up.record(0)).lines
    greenness = [line.color.g - line.color.r for line in thin]
    assert greenness == sorted(greenness, reverse=True)
    assert greenness[0] > 0 > greenness[-1]


def test_lines_have_a_pose_and_a_type_that_foxglove_draws(made_up):
    entity = encode(made_up.record(2))
    assert (entity.frame_id, entity.id, entity.timestamp.nanos) == ("map", "candidates", 200_000_000)
    assert all(line.type == line.LINE_LIST and line.pose.orientation.w == 1.0 for line in entity.lines)


def test_infinite_costs_are_drawn_last(made_up):
    record = made_up.record(0)
    costs = record.decision.costs
    total = np.where(costs.v > 0.5, np.inf, costs.total)
    record = replace(record, decision=replace(record.decision, costs=replace(costs, total=total)))
    *thin, _ = encode(record).lines
    assert sum(len(arcs(line)) for line in thin) == 402


def test_the_cone_distribution_reads_back_through_its_own_schema():
    pool = DescriptorPool()
    for file in candidates.cone_schema().file:
        pool.Add(file)
    message_class = GetMessageClass(pool.FindMessageTypeByName("mjnav.ConeDistribution"))
    samples, desired = np.linspace(-3.0, 1.0, 625), np.linspace(-2.0, 0.0, 17)
    data = candidates.encode_cone(ConeDistribution("person4", samples, desired, 0.1 + 0.2))
    message = message_class.FromString(data)
    assert (message.obstacle, message.safe_share) == ("person4", 0.1 + 0.2)
    np.testing.assert_array_equal(np.array(message.samples, "f4"), samples.astype("f4"))
    np.testing.assert_array_equal(np.array(message.desired, "f4"), desired.astype("f4"))

from dataclasses import replace

import numpy as np
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud

from mjnav.geometry.angles import wrap
from mjnav.log.encode.particles import decode_particles, encode_robot_particles, encode_track_particles


def test_the_robots_particles_read_back_as_finely_as_is_said(made_up):
    belief = made_up.record(0).belief
    turned = belief.particles + np.array([0.0, 0.0, 3.0])  # some beyond pi
    belief = replace(belief, particles=turned, weights=made_up.rng.dirichlet(np.ones(len(turned))))
    found = decode_particles(PointCloud.FromString(encode_robot_particles(belief)))
    assert list(found) == ["x", "y", "theta", "weight"]
    for i, name in enumerate(("x", "y")):
        np.testing.assert_array_equal(found[name], turned[:, i].astype("f4"))
    assert np.abs(wrap(found["theta"] - turned[:, 2])).max() <= 0.5001e-4
    np.testing.assert_allclose(found["weight"], belief.weights, rtol=1e-4, atol=belief.weights.max() / 131_000)


def test_the_tracks_particles_name_their_track_and_each_has_weights_of_its_own(made_up):
    tracks = made_up.record(0).tracks
    tracks = tuple(replace(t, weights=made_up.rng.dirichlet(np.full(200, 0.1))) for t in tracks)
    found = decode_particles(PointCloud.FromString(encode_track_particles(0.0, tracks)))
    assert list(found) == ["x", "y", "vx", "vy", "weight", "track"]
    for place, track in enumerate(tracks):
        rows = found["track"] == place
        np.testing.assert_array_equal(found["x"][rows], track.particles[:, 0].astype("f4"))
        np.testing.assert_array_equal(found["y"][rows], track.particles[:, 1].astype("f4"))
        for i, name in enumerate(("vx", "vy"), start=2):
            np.testing.assert_allclose(found[name][rows], track.particles[:, i], atol=0.5001e-3)
        np.testing.assert_allclose(found["weight"][rows], track.weights, rtol=1e-3, atol=track.weights.max() / 131_000)


def test_what_16_bits_cannot_hold_is_brought_to_what_they_can(made_up):
    belief, (track, *_) = made_up.record(0).belief, made_up.record(0).tracks
    belief = replace(belief, weights=np.where(np.arange(500) < 2, np.nan, belief.weights))
    assert (decode_particles(PointCloud.FromString(encode_robot_particles(belief)))["weight"][:2] == 0.0).all()
    particles = track.particles.copy()
    particles[:3, 2] = np.nan, 1e9, -np.inf
    cloud = PointCloud.FromString(encode_track_particles(0.0, (replace(track, particles=particles),)))
    assert decode_particles(cloud)["vx"][:3].tolist() == [-32.768, 32.767, -32.768]


def integers(values, steps):
    return np.fmin(np.fmax(np.rint(values * steps), -32768.0), 32767.0).astype("<i2")


def shares(weights):
    return np.fmax(np.rint(weights * (65535 / np.fmax.reduce(weights, initial=1e-300))), 0.0).astype("<u2")


def test_every_bit_of_the_rows_is_that_of_a_literal_encoder(made_up):
    belief, tracks = made_up.record(0).belief, made_up.record(0).tracks[:2]
    poses, weights = belief.particles.copy(), made_up.rng.dirichlet(np.full(500, 0.1))
    pi = np.nextafter(np.pi, [0.0, 4.0])
    poses[:8, 2] = np.pi, -np.pi, *pi, *-pi, np.nan, 1e9
    poses[8:100, 2] = made_up.rng.uniform(-10.0, 10.0, 92)
    weights[:2] = np.nan, 0.0
    for given in (belief.weights, weights, np.full(500, np.nan)):
        belief = replace(belief, particles=poses, weights=given)
        data = np.frombuffer(PointCloud.FromString(encode_robot_particles(belief)).data, "<f4,<f4,<i2,<u2")
        expected = (*poses[:, :2].T.astype("<f4"), integers(wrap(poses[:, 2]), 10_000), shares(given))
        assert [data[f"f{i}"].tobytes() for i in range(4)] == [column.tobytes() for column in expected]
    states = tracks[0].particles.copy()
    states[:4, 2:] = np.array([[np.nan, np.inf], [-np.inf, 33.0], [-33.0, 32.7675], [32.7665, -32.7685]])
    tracks = (replace(tracks[0], particles=states), replace(tracks[1], weights=weights[300:]))
    data = np.frombuffer(PointCloud.FromString(encode_track_particles(0.0, tracks)).data, "<f4,<f4,<i2,<i2,<u2,<u2")
    for number, track in enumerate(tracks):
        x, y, vx, vy = track.particles.T
        expected = (x.astype("<f4"), y.astype("<f4"), integers(vx, 1000), integers(vy, 1000), shares(track.weights))
        part = data[data["f5"] == number]
        assert [part[f"f{i}"].tobytes() for i in range(5)] == [column.tobytes() for column in expected]

"""What a page's arrays are made of: packed columns, histograms of the cone, ranks of the candidates."""

import gzip
from base64 import b64decode

import numpy as np
import pytest

from mjnav.report.run_page.layers import CONE_BINS, cone_bins
from mjnav.report.run_page.packed import Packer
from mjnav.report.run_page.run_frames import MAX_FREE, candidate_ranks


def unpacked(document, name):
    """A measured array as the page makes it again, by plain loops."""
    field, data = document["fields"][name], gzip.decompress(b64decode(document["gzip"]))
    length = int(np.prod(field["shape"]))
    stored = data[field["offset"] : field["offset"] + 2 * length]
    columns = []
    for column in range(length // field["shape"][0]):
        code, values = 0, []
        for row in range(field["shape"][0]):
            place = column * field["shape"][0] + row
            code = (code + stored[place] + 256 * stored[length + place]) % 65536
            values.append(np.nan if code == 65535 else field["low"] + field["step"] * code)
        columns.append(values)
    return np.array(columns).T.reshape(field["shape"])


def test_measured_numbers_come_back_to_half_a_step_and_missing_ones_stay_so():
    values = np.random.default_rng(0).normal(scale=3.0, size=(50, 4, 2))
    values[3:9, 2] = np.nan
    packer = Packer()
    packer.numbers("before", np.zeros(3, np.uint8))
    packer.measured("some", values, 0.01)
    found = unpacked(packer.packed(), "some")
    np.testing.assert_array_equal(np.isnan(found), np.isnan(values))
    assert np.nanmax(np.abs(found - values)) <= 0.005 + 1e-12


def test_a_range_that_is_too_wide_for_the_step_takes_a_coarser_one():
    values = np.array([-1e6, 0.0, 3.0, 1e6])
    packer = Packer()
    packer.measured("wide", values, 0.001)
    assert np.abs(unpacked(packer.packed(), "wide") - values).max() <= 2e6 / 65533 / 2 * 1.001


def test_the_same_arrays_give_the_same_text():
    def text():
        packer = Packer()
        packer.measured("a", np.arange(10.0), 0.1)
        return packer.packed()["gzip"]

    assert text() == text()


def test_every_sample_is_counted_on_its_side_of_zero():
    rng = np.random.default_rng(1)
    samples, desired = rng.normal(size=400), -rng.random(100)
    bins = cone_bins({1: (samples, desired), 2: (np.array([0.0, 1e-9]), np.zeros(0))}, 3)
    safe = round(-bins.low / bins.width)
    shares = bins.shares / 255
    assert bins.shares.shape[2] >= CONE_BINS
    assert shares[1, 0, :safe].sum() == pytest.approx(np.mean(samples <= 0), abs=0.5 * safe / 255)
    assert shares[1, 0].sum() == pytest.approx(1.0, abs=0.05)
    assert not bins.shares[1, 1, safe:].any()
    assert shares[2, 0, safe - 1 : safe + 1].tolist() == pytest.approx([0.5, 0.5], abs=1 / 255)  # 0 itself is safe
    assert not bins.shares[0].any()


def test_no_samples_make_no_histograms():
    assert cone_bins({}, 3) is None
    assert cone_bins({0: (np.zeros(0), np.zeros(0))}, 3) is None


def test_ranks_of_a_grid_are_those_of_its_costs():
    v, omega = (
        axis.ravel() for axis in np.meshgrid(np.linspace(0.3, 0.5, 20), np.linspace(-0.4, 0.2, 20), indexing="ij")
    )
    total = np.random.default_rng(2).random(402)
    ranks = candidate_ranks(np.append(v, [0.4, 0.3]), np.append(omega, [0.0, -0.1]), total, (20, 20))
    assert ranks.free is None
    assert ranks.window.tolist() == [0.3, 0.5, -0.4, 0.2]
    cheaper = (total[:, None] > total).sum(axis=1)  # candidates than each
    np.testing.assert_array_equal(ranks.level, (8 * (cheaper[:400] + 1) - 1) // 402)


def test_candidates_that_are_no_grid_keep_their_own_controls():
    rng = np.random.default_rng(3)
    v, omega, total = rng.uniform(0.3, 0.8, 300), rng.uniform(-1.0, 1.0, 300), rng.random(300)
    ranks = candidate_ranks(v, omega, total, (20, 20))
    assert ranks.free.shape == (MAX_FREE, 2)
    assert (np.diff(ranks.level.astype(int)) >= 0).all()
    low, high = ranks.window[::2], ranks.window[1::2]
    cheapest = low + (high - low) * ranks.free[0] / 255
    np.testing.assert_allclose(cheapest, [v[total.argmin()], omega[total.argmin()]], atol=0.01)


def test_a_robot_that_cannot_move_has_no_ranks():
    still = np.zeros(402)
    assert candidate_ranks(still, np.linspace(-1, 1, 402), still, (20, 20)) is None

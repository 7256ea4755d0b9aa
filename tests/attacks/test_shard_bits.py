"""No flipped bit of a shard of results comes back as another value."""

import random

import pytest

from mjnav.errors import MjnavError
from mjnav.study.store import Store
from tests.study.made_up import row

FLIPS = 400


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "results")
    with store.writing(""):
        store.append([row("rkhs", seed, 1.5 * seed, outcome="goal", state_hash=f"{seed:064x}") for seed in range(40)])
    return store


def test_every_flipped_bit_is_refused_with_the_shards_name(store):
    (shard,) = store.folder.glob("part-*.parquet")
    content, whole = shard.read_bytes(), store.rows()
    chance, refused = random.Random(11), 0
    for _ in range(FLIPS):
        place = chance.randrange(8 * len(content))
        damaged = bytearray(content)
        damaged[place // 8] ^= 1 << place % 8
        shard.write_bytes(damaged)
        with pytest.raises(MjnavError) as told:
            store.rows()
        refused += str(told.value).startswith(f"{shard}: damaged (")
        assert "\n" not in str(told.value)
    assert refused == FLIPS
    shard.write_bytes(content)
    assert store.rows().equals(whole)


@pytest.mark.parametrize("size", [0, 3, 5000, -1])
def test_a_shard_that_was_cut_off_is_refused_and_its_message_says_what_to_do(store, size):
    (shard,) = store.folder.glob("part-*.parquet")
    shard.write_bytes(shard.read_bytes()[:size])
    with pytest.raises(MjnavError, match=r"damaged.*remove it, then --resume runs its episodes again$"):
        store.done()
    shard.unlink()
    assert store.done() == set()

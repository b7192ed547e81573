"""No two random streams of a campaign are the same, whatever their items."""

import itertools

import numpy as np
import pytest

from dustfall.streams import Purpose, stream


def first_number(purpose, seed, *items):
    return int(stream(purpose, seed, *items).bit_generator.random_raw())


def test_no_two_streams_of_a_campaign_are_equal():
    # Every purpose with no item, and with items that pad each other with zeros.
    items = [
        key for length in range(4) for key in itertools.product((0, 1, 2, 2**32 - 1), repeat=length)
    ]
    drawn = [first_number(p, seed, *key) for p in Purpose for seed in (0, 1, 2) for key in items]
    assert len(set(drawn)) == len(drawn)


def test_scenes_of_a_whole_campaign_have_streams_of_their_own():
    drawn = {first_number(Purpose.SCENE, 1, law, k) for law in range(3) for k in range(14_000)}
    assert len(drawn) == 3 * 14_000


def test_a_stream_is_the_same_each_time():
    a, b = (stream(Purpose.START, 1, 7).random(5) for _ in range(2))
    np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("seed", [-1, 1.5, 2**32])
def test_a_seed_that_is_no_whole_number_is_refused(seed):
    with pytest.raises(ValueError, match="integers 0 to"):
        stream(Purpose.SCENE, seed)

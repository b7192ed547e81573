import numpy as np
import pytest

from dustfall.forces.learned import load_model
from dustfall.sedimentation.blocks import BLOCK, Blocks
from tests.sedimentation.runs import run


@pytest.mark.parametrize("particles", [1, BLOCK - 1, BLOCK, BLOCK + 1, 5 * BLOCK + 7])
@pytest.mark.parametrize("threads", [1, 3])
def test_blocks_cover_every_row_once(particles, threads):
    met = np.zeros(particles, int)

    def work(first, last):
        met[first:last] += 1

    with Blocks(particles, threads) as blocks:
        blocks.run(work)
    assert (met == 1).all()


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_in_a_block_is_not_lost(threads):
    def work(first, last):
        raise FloatingPointError(f"rows {first} to {last - 1}")

    with Blocks(10, threads) as blocks, pytest.raises(FloatingPointError, match="rows 0 to 9"):
        blocks.run(work)


def test_bits_do_not_depend_on_the_number_of_threads(tmp_path):
    one, two = (
        run(tmp_path, load_model(), particles=2500, duration=1.0, threads=threads)
        for threads in (1, 2)
    )
    for a, b in zip(one, two, strict=True):
        assert a.identical(b)


def test_no_threads_are_refused():
    with pytest.raises(ValueError, match="threads is 0"):
        Blocks(10, 0)

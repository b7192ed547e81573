"""The numbers of the truncation bound hold against what the script that set them samples."""

from dustfall.benchmarks.truncation import KINDS, sampled


def test_the_bound_lies_above_every_sampled_error_and_not_without_measure():
    samples = sampled(5, seed=3)
    assert set(samples["kind"]) == set(KINDS)
    assert (samples["bound"] >= samples["error"]).all()
    assert (samples["bound"] / samples["error"]).median() < 100.0

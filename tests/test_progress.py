"""Rate and time to go are those of what is done now, not of what was done before."""

import io
import re

import pytest

from dustfall.progress import Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Seconds that the test sets."""
    now = [100.0]
    monkeypatch.setattr("dustfall.progress.time.monotonic", lambda: now[0])
    return now


def lines(clock, reports, total):
    """What is written of reports, one every ten seconds."""
    stream = io.StringIO()
    progress = Progress("case", "steps", stream=stream)
    for done in reports:
        clock[0] += 10.0
        progress.report(done, total)
    return stream.getvalue().splitlines()


def test_a_run_that_goes_on_counts_what_it_does_itself(clock):
    assert lines(clock, [9000, 9050, 9100], 10_000) == [
        "case: 9000 of 10000 steps, 0 a second, inf s to go",
        "case: 9050 of 10000 steps, 2.5 a second, 380 s to go",
        "case: 9100 of 10000 steps, 3.33 a second, 270 s to go",
    ]
    assert lines(clock, [20], 20) == ["case: 20 of 20 steps, 0 a second, 0 s to go"]


@pytest.mark.parametrize("first", [0, 1])
def test_one_that_begins_counts_all(clock, first):
    assert lines(clock, [first, 10], 20)[-1] == "case: 10 of 20 steps, 0.5 a second, 20 s to go"


def test_a_bar_that_goes_on_leaves_the_rate_to_what_is_done_now():
    stream = Terminal()
    with Progress("case", "steps", stream=stream) as progress:
        progress.report(9000, 10_000)
        assert (progress.bar.initial, progress.bar.n) == (9000, 9000)
        progress.report(9100, 10_000)
        assert progress.bar.n == 9100
    assert re.search(r"9100/10000", stream.getvalue())

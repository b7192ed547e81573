"""Two hundred bad configurations and fifty bad start files are refused in one sentence each."""

from itertools import islice

import numpy as np
import pytest

from dustfall.sedimentation import random_positions
from dustfall.sedimentation.start import read_start
from tests.faults.conftest import count
from tests.workflow.test_configuration import nested
from workflow.configuration import ConfigurationError, configure, keys, load_schema

pytestmark = pytest.mark.faults

CONFIGURATIONS, STARTS = 200, 50


def bad_settings():
    """Keys with values that none of them may have, one kind of mistake after the other."""
    known = keys(load_schema())
    for wrong in (None, {"a": 1}, "no such word", [[1]], float("nan"), 1e300, -1e-300, 10**400):
        for key, part in known.items():
            text = part["type"] == "string" if "type" in part else False
            if not (text and "pattern" not in part and isinstance(wrong, str)):
                yield nested(key, wrong), key
    for key in known:
        yield nested(f"{key}_", 1), key


@pytest.mark.parametrize("share", range(4))
def test_bad_configurations_are_refused_with_the_name_of_the_key(ledger, share):
    every = list(bad_settings())
    # All kinds of mistakes, at keys all over the schema.
    chosen = every[:: len(every) // CONFIGURATIONS][share:CONFIGURATIONS:4]
    outcomes = []
    for settings, key in chosen:
        try:
            configure(settings)
        except ConfigurationError as error:
            words = str(error)
            told = key.split(".")[-1] in words and words.endswith(".") and "\n" not in words
            outcomes.append("detected" if told else f"crashed ({key}: {words})")
        except Exception as error:
            outcomes.append(f"crashed ({key}: {type(error).__name__}: {error})")
        else:
            outcomes.append(f"silent ({settings})")
    count(ledger, "a bad configuration", outcomes)


def bad_starts():
    """Tables of forty particles with one mistake each."""
    good = random_positions(np.random.default_rng(1), 40, 1e-3)
    rows = [" ".join(f"{x:.9g}" for x in row) for row in good]
    for k, word in enumerate(["nan", "inf", "-inf", "1e300", "-1e20", "x", "1,5", "--", "0x10"]):
        for row in (0, 17, 39):
            yield "\n".join([*rows[:row], f"{word} 1 {k}", *rows[row + 1 :]])
    for row in (0, 20, 39):
        yield "\n".join([*rows[:row], rows[row] + " 1", *rows[row + 1 :]])
        yield "\n".join([*rows[:row], rows[row].rsplit(" ", 1)[0], *rows[row + 1 :]])
        yield "\n".join(rows[:row] + rows[row + 1 :])
        yield "\n".join([*rows, rows[row]])
        yield "\n".join([*rows[:row], rows[row - 1], *rows[row + 1 :]])
    for scale in (25e-6, 1e-3, 1e12):
        yield "\n".join(" ".join(f"{scale * x:.9g}" for x in row) for row in good)
    for fast in (1e3, 1e30, "nan"):
        yield "\n".join(f"{row} 0 0 {fast}" for row in rows)
    yield from ("", "\n" * 1000, "# nothing\n", "x y w\n" + "\n".join(rows), "\0" * 100)


def test_bad_start_files_are_refused_with_the_name_of_the_file(ledger, tmp_path):
    path, outcomes = tmp_path / "start.txt", []
    for content in islice(bad_starts(), STARTS):
        path.write_text(content)
        try:
            read_start(path, 40, 1e-3)
        except ValueError as error:
            words = str(error)
            told = "start.txt" in words and "\n" not in words
            outcomes.append("detected" if told else f"crashed ({words})")
        except Exception as error:
            outcomes.append(f"crashed ({type(error).__name__}: {error})")
        else:
            outcomes.append(f"silent ({content[:60]})")
    count(ledger, "a bad start file", outcomes)
    assert len(outcomes) == STARTS

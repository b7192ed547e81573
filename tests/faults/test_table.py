"""The table of the docs tells of no fault that went through."""

from pathlib import Path

from tests.faults.conftest import OUTCOMES, RULE

PAGE = Path(__file__).resolve().parents[2] / "docs/faults.md"


def test_nothing_in_the_table_of_the_docs_was_silent_or_crashed():
    _, rows = PAGE.read_text(encoding="utf-8").rsplit(RULE, 1)
    assert rows.strip()
    for row in rows.strip().splitlines():
        fault, tried, *counts = (part.strip() for part in row.strip("|").split("|"))
        found = dict(zip(OUTCOMES, map(int, counts), strict=True))
        assert int(tried) == sum(found.values()) > 0, fault
        assert found["silent"] == found["crashed"] == 0, fault

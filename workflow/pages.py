"""Pages of the documentation whose numbers come from files: a template, and tables beside it.

A template is Jinja2 text. `table(name, columns)` writes a table of the folder in Markdown,
`tables.name` is the DataFrame itself, and the filter `written` writes one number of a sentence.
"""

import re
import string
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd

Pattern = str | Sequence[str]
"""How a cell is written from its row, like "{value:.3f} ± {half:.1g}"; of several patterns the
first whose fields the row all has."""

NEAR_ONE = 1e-3
"""Distance from one below which a score is written by that distance: 1 - 3.2e-6."""

PLAIN = (0.01, 100.0)
"""Range in which an error is written without an exponent."""

MISSING = "*Not measured in this campaign.*"
"""What stands in place of a table that there is no file of."""


class Written(string.Formatter):
    """`str.format` with some formats beside Python's.

    power: 1e-4, with the digits that tell the number and no more. error: two digits, 3.1e-5, 0.19.
    near_one: 1 - 3.2e-6 for what is nearly one, else four decimals. count: 33,000. percent: 42.9 %.
    short: two digits and no power, 120,000, 9.5.
    """

    def format_field(self, value: Any, format_spec: str) -> str:
        match format_spec:
            case "power":
                return np.format_float_scientific(value, trim="-", exp_digits=1)
            case "error" if value == 0 or PLAIN[0] <= abs(value) < PLAIN[1]:
                return f"{value:#.2g}".rstrip(".") if value else "0"
            case "error":
                return np.format_float_scientific(value, 1, unique=False, exp_digits=1)
            case "near_one":
                rest = 1.0 - value
                near = 0 < rest < NEAR_ONE
                return f"1 - {self.format_field(rest, 'error')}" if near else f"{value:.4f}"
            case "count":
                return f"{value:,.0f}"
            case "short":
                rounded = float(f"{value:.2g}")
                return f"{rounded:,.0f}" if abs(rounded) >= 10 else f"{rounded:g}"
            case "percent":
                return f"{100 * value:.1f} %"
        return super().format_field(value, format_spec)


WRITTEN = Written()


def written(value: Any, format_spec: str) -> str:
    """Write one value in a format of `Written`. Raises ValueError for a missing one."""
    if pd.isna(value):
        raise ValueError("there is no number to write here: the value is missing")
    return WRITTEN.format_field(value, format_spec)


def markdown_table(table: pd.DataFrame, columns: Mapping[str, Pattern]) -> str:
    """Write rows of a table in Markdown.

    columns: title -> pattern of its cells. A cell none of whose patterns has all its fields in the
    row (missing values count as absent) stays empty. Raises KeyError for a field that is no column
    of the table, and ValueError for a table without rows.
    """
    if table.empty:
        raise ValueError("a table without rows says nothing: leave it out")
    lines = [list(columns), ["---"] * len(columns)]
    for row in table.to_dict("records"):
        lines.append([_cell(row, pattern) for pattern in columns.values()])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(row: Mapping, pattern: Pattern) -> str:
    for one in [pattern] if isinstance(pattern, str) else pattern:
        fields = [field for _, field, _, _ in WRITTEN.parse(one) if field is not None]
        if not any(pd.isna(row[field]) for field in fields):
            return WRITTEN.format(one, **row).replace("|", r"\|")
    return ""


def wide(table: pd.DataFrame, rows: str, by: str) -> pd.DataFrame:
    """One row for each value of the column `rows`; the others stand side by side for each of `by`.

    value of the row with by = x becomes the column value_x. Rows keep their order. Raises
    ValueError where two rows share both values.
    """
    pivoted = table.pivot(index=rows, columns=by)
    pivoted.columns = pd.Index([f"{name}_{value}" for name, value in pivoted.columns])
    return pivoted.loc[table[rows].unique()].reset_index()


def read_tables(folder: Path) -> dict[str, pd.DataFrame]:
    """Every table of a folder of CSV files by its name."""
    return {path.stem: pd.read_csv(path) for path in sorted(folder.glob("*.csv"))}


def render(template: Path, tables: Mapping[str, pd.DataFrame], **values: Any) -> str:
    """Fill in a template with tables and further values.

    Raises jinja2.UndefinedError for a name that the template uses and nothing gives it.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters["written"] = written

    def table(name: str, columns: Mapping[str, Pattern], side_by_side: Sequence[str] = ()) -> str:
        """A table of the page, as it is or made `wide`, or the word for one that is not there."""
        if name not in tables:
            return MISSING
        rows = wide(tables[name], *side_by_side) if side_by_side else tables[name]
        return markdown_table(rows, columns)

    text = environment.get_template(template.name).render(
        tables=tables, table=table, missing=MISSING, **values
    )
    # What a condition leaves out leaves its blank lines.
    return re.sub(r"\n{3,}", "\n\n", text)

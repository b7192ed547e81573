"""Write tables as pages, numbers to four digits, for the report to show."""

import pandas as pd

import joblog
from dustfall.files import atomic

joblog.start(snakemake)

PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>{name}</title>
<style>
body {{ font: 14px sans-serif; margin: 1em; }}
table {{ border-collapse: collapse; }}
th, td {{ padding: 0.2em 0.7em; text-align: right; border-bottom: 1px solid #ddd; }}
th {{ position: sticky; top: 0; background: white; }}
</style>
{table}
</html>
"""

for name, source in snakemake.input.items():
    table = pd.read_csv(source).to_html(
        index=False, border=0, na_rep="", float_format="{:.4g}".format
    )
    with atomic(snakemake.output[name]) as path:
        path.write_text(PAGE.format(name=name, table=table), encoding="utf-8")

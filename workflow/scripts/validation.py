"""Write the page of validation from what the campaign left, and its tables and pictures."""

from pathlib import Path

import joblog
from dustfall.files import atomic
from workflow.validation import collect, copy_pictures, page, provenance

joblog.start(snakemake)

params = snakemake.params
campaign, docs = Path(), Path(params.docs)
tables = docs / "validation"
collect(campaign, tables, provenance(params.configuration))
copy_pictures(campaign, docs / "pictures")
with atomic(docs / "validation.md") as path:
    text = page(Path(snakemake.input.template), tables)
    path.write_text(text, encoding="utf-8")

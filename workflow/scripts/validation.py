"""Write the pages whose numbers a campaign left, and their tables and pictures."""

from pathlib import Path

import joblog
from dustfall.files import atomic
from workflow.validation import PAGES, collect, copy_pictures, page, provenance

joblog.start(snakemake)

params = snakemake.params
if params.own_data:
    raise ValueError(
        f"dataset.file is {params.own_data}, but must be empty: the pages of the docs are about "
        "scenes that a campaign draws and solves itself"
    )
campaign, docs = Path(), Path(params.docs)
found = provenance(params.configuration)
copy_pictures(campaign, docs / "pictures")
templates = {Path(file).name: Path(file) for file in snakemake.input.templates}
for name, tables in PAGES.items():
    collect(campaign, docs / name, found, tables)
    with atomic(docs / f"{name}.md") as path:
        path.write_text(page(templates[f"{name}.md.jinja"], docs / name), encoding="utf-8")

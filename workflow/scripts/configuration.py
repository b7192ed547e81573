"""Write the configuration of this run, complete and checked, beside its results."""

import json

import yaml

import joblog
from dustfall.files import atomic

joblog.start(snakemake)

with atomic(snakemake.output[0]) as path:
    settings = json.loads(snakemake.params.config)
    path.write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")

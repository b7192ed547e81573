"""Another workflow can take in this one by `module`, as docs/extend.md says."""

import re

import pytest
import yaml

from tests.workflow.conftest import ROOT, Project

MINE = """
configfile: "mine.yaml"

{module}

rule mine:
    input: "{prefix}results/config.yaml"
    output: "mine.txt"
    default_target: True
    shell: "cp {{input}} {{output}}"
"""


@pytest.fixture
def user(tmp_path) -> Project:
    """A workflow of someone else's, with a checkout of this one in the folder `dustfall`."""
    (tmp_path / "dustfall").mkdir()
    checkout = Project(tmp_path / "dustfall")
    checkout.folder = tmp_path
    page = (ROOT / "docs/extend.md").read_text(encoding="utf-8")
    (module,) = re.findall(r"```\n(module dustfall:.*?)```", page, re.S)
    (prefix,) = re.findall(r'prefix: "(\w+)"', module)
    (tmp_path / "Snakefile").write_text(MINE.format(module=module, prefix=f"{prefix}/"))
    return checkout


def test_its_rules_run_with_the_configuration_that_is_handed_in(user):
    # What YAML can do elsewhere in that file is not for this project to allow.
    (user.folder / "mine.yaml").write_text("mine: &it {a: 1}\nalso: *it\ndustfall: {seed: 7}")
    user.run("--cores", "1")
    assert yaml.safe_load((user.folder / "mine.txt").read_text())["seed"] == 7
    made = user.folder / "dust/results/config.yaml"
    assert (made.parent / "checksums/config.yaml.sha256").exists()
    user.run("--cores", "1", "--", "dustfall_verify")
    made.write_text("seed: 8")
    done = user.snakemake("-c1", "--", "dustfall_verify")
    assert "dust/results/config.yaml is damaged" in done.stdout


def test_all_of_it_is_planned_below_the_prefix(user):
    (user.folder / "mine.yaml").write_text("dustfall: {}")
    words = user.dry_run("--", "dustfall_all")
    files = re.findall(r"^ +(?:input|output|log): (.*)$", words, re.M)
    files = {file for line in files for file in line.split(", ")}
    assert "dust/results/sedimentation/n33000_phi1e-03_ga4.nc" in files
    assert {file.split("/")[0] for file in files} == {"dust"}


def test_its_configuration_is_checked(user):
    (user.folder / "mine.yaml").write_text("dustfall: {seed: -7}")
    done = user.snakemake("--cores", "1")
    assert done.returncode == 1
    assert "Configuration: seed is -7, but must be a whole number" in done.stdout + done.stderr

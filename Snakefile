# The campaign: random scenes, their forces, force models, sedimentation, figures.
# `snakemake -n` shows the plan, `snakemake all` runs it, `snakemake figures` makes the figures,
# `snakemake exports` writes trajectories for ParaView, `snakemake benchmarks` times the solver,
# `snakemake studies` compares time steps, `snakemake openfoam` settles a cloud in OpenFOAM too,
# `snakemake validation` writes the numbers of the docs.
import json
import os
import sys

from snakemake.utils import min_version

from dustfall.forces.registry import trained_models
from workflow import plan, stops, terminal
from workflow.configuration import ConfigurationError, configure, read_file
from workflow.cost import GO_ON, CostError, check_jobs, check_plan, cost
from workflow.library import ROOT, cache_on_node, digest, library_files, named_by

min_version("9.0")


configfile: ROOT / "config" / "config.yaml"


try:
    go_on = config.pop(GO_ON, False)
    # Of a workflow that has this one as a module the files are its own.
    for file in workflow.configfiles if workflow.modifier.is_main_snakefile() else ():
        read_file(file)
    config = configure(config)
    bound = cost(config)
    # A job on a cluster is a part of what was checked, and its node another machine.
    if workflow.is_main_process:
        check_plan(bound, go_on)
except (ConfigurationError, CostError) as error:
    sys.exit(f"Configuration: {error}")

# The library of this checkout is the one whose files the rules watch, so it is the one they run;
# each job keeps to one thread, because jobs fill the cores and bits must not depend on their number.
os.environ.update(PYTHONPATH=str(ROOT), NUMBA_NUM_THREADS="1")
if "SLURM_JOB_ID" in os.environ:
    # Compiled code stays on the node: a shared file system is slow, and nodes differ.
    os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_on_node()))


LINE = terminal.follow(workflow)
stops.tell_interrupts(LINE.stop)


report: "workflow/report/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/scenes.smk"
include: "workflow/rules/stokes.smk"


if config["dataset"]["file"]:

    include: "workflow/rules/own_data.smk"

else:

    include: "workflow/rules/dataset.smk"


include: "workflow/rules/training.smk"
include: "workflow/rules/sedimentation.smk"
include: "workflow/rules/exports.smk"
include: "workflow/rules/analysis.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/benchmarks.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/openfoam.smk"


rule all:
    """Everything that the configuration asks for."""
    default_target: True
    input:
        "results/config.yaml",
        "results/dataset/summary.csv",
        "results/dataset/summary.json",
        SOLVER,
        "results/model/evaluation.csv",
        # Also of those cases whose series alone tells something, so that none is lost unseen.
        expand("results/sedimentation/{case}.nc", case=CASES),
        "results/analysis/independence_of_n.csv",
        "results/analysis/neighbour_changes.csv",
        "results/analysis/local_volume_fraction.csv",
        "results/model/ablation.csv",
        rules.tables.output,
        FIGURES,


include: "workflow/rules/validation.smk"


rule figures:
    """The figures, and whatever they need."""
    input:
        FIGURES,


rule exports:
    """Trajectories for ParaView; no part of `all`, as they repeat what is there already."""
    input:
        expand("results/exports/{case}.vtkhdf", case=CASES),


rule benchmarks:
    """Error against run time of solver and models; no part of `all`, as timings differ."""
    input:
        "results/benchmarks/solver.csv",
        "results/benchmarks/moving.csv",
        "results/benchmarks/moving_cost.csv",
        "results/benchmarks/moving_estimates.csv",
        "results/benchmarks/settling.csv",
        "results/benchmarks/stress.csv",
        "results/figures/accuracy_vs_cost.png",


rule studies:
    """What numerical settings do to the results; no part of `all`."""
    input:
        "results/studies/step_size.csv",
        "results/studies/neighbour_numbers.csv",
        "results/figures/neighbour_numbers.png",
        "results/studies/moving_neighbours.csv",
        "results/studies/moving_spheres.csv",


rule openfoam:
    """OpenFOAM beside this package; no part of `all`, as it needs what `make openfoam` builds."""
    input:
        "results/figures/openfoam_settling.png",


rule configuration:
    """Write down the configuration of this run, with every default."""
    output:
        "results/config.yaml",
    log:
        "logs/configuration.log",
    localrule: True
    params:
        config=json.dumps(config),
    script:
        "workflow/scripts/configuration.py"


rule verify:
    """Compare every file in results/ with the checksum that its job wrote."""
    log:
        "logs/verify.log",
    localrule: True
    script:
        "workflow/scripts/verify.py"


onstart:
    stops.require_writable()
    stops.be_alone()
    stops.clear()
    print(f"The whole campaign takes about {bound}; what is there already is not made again.")
    if workflow.local_exec:
        try:
            check_jobs(bound, workflow.cores or 1, config["idnn"]["device"], go_on)
        except CostError as error:
            sys.exit(f"Configuration: {error}")


onsuccess:
    stops.clear()
    print("Done: see results/, and `snakemake --report report.html` for an overview.")


onerror:
    LINE.stop()
    stops.announce(log)

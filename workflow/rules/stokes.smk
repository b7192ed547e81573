rule stokes:
    """Plan and solve the Stokes problem of every scene of a shard."""
    input:
        scenes="results/scenes/{law}-{shard}.h5",
        library=library("solve.py"),
    output:
        "results/stokes/{law}-{shard}.h5",
    log:
        "logs/stokes/{law}-{shard}.log",
    benchmark:
        "benchmarks/stokes/{law}-{shard}.tsv"
    params:
        tolerance=config["stokes"]["tolerance"],
    script:
        "../scripts/solve.py"


rule mesh_study:
    """Drag on an isolated sphere against mesh size, for each discretisation."""
    input:
        library=library("mesh_study.py"),
    output:
        study="results/analysis/mesh_study.csv",
        convergence="results/analysis/grid_convergence.csv",
    log:
        "logs/analysis/mesh_study.log",
    benchmark:
        "benchmarks/analysis/mesh_study.tsv"
    params:
        sizes=config["meshing"]["study_sizes"],
    script:
        "../scripts/mesh_study.py"

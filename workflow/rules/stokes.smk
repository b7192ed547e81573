rule stokes:
    """Plan and solve the Stokes problem of every scene of a shard."""
    input:
        scenes="results/scenes/{law}-{shard}.h5",
    output:
        "results/stokes/{law}-{shard}.h5",
    log:
        "logs/stokes/{law}-{shard}.log",
    benchmark:
        "benchmarks/stokes/{law}-{shard}.tsv"
    params:
        library=library("solve.py"),
        tolerance=config["stokes"]["tolerance"],
    script:
        "../scripts/solve.py"

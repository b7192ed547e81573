rule operators:
    """Assemble and factor the one-body operator of a template."""
    input:
        template="results/templates/sphere-{size}.h5",
        library=library("one_body.py"),
    output:
        "results/operators/sphere-{size}.h5",
    log:
        "logs/operators/sphere-{size}.log",
    benchmark:
        "benchmarks/operators/sphere-{size}.tsv"
    script:
        "../scripts/one_body.py"


rule stokes:
    """Solve the Stokes problem of every scene of a shard."""
    input:
        meshes="results/meshes/{law}-{shard}.h5",
        operator=f"results/operators/{TEMPLATE}.h5",
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

rule dataset:
    """Join the shards, check them and keep the scenes that converged."""
    input:
        scenes=expand("results/scenes/{shard}.h5", shard=SHARDS),
        solutions=expand("results/stokes/{shard}.h5", shard=SHARDS),
    output:
        data="results/dataset/forces.h5",
        summary="results/dataset/summary.csv",
    log:
        "logs/dataset.log",
    benchmark:
        "benchmarks/dataset.tsv"
    params:
        library=library("dataset.py"),
        seed=config["seed"],
        numbers=config["scenes"]["number"],
        phi_min=config["scenes"]["phi_min"],
        phi_max=config["scenes"]["phi_max"],
        tolerance=config["stokes"]["tolerance"],
        unconverged_share=config["dataset"]["unconverged_share"],
    script:
        "../scripts/dataset.py"

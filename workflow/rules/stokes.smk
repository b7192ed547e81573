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
        method=config["stokes"]["method"],
    script:
        "../scripts/solve.py"


rule scene_mesh:
    """Keep the meshes of a scene, with traction and pressure."""
    input:
        scenes=lambda wc: f"results/scenes/{plan.shard_of(config, wc.law, wc.scene)}.h5",
    output:
        "results/meshes/{law}-{scene}.msh",
        "results/meshes/{law}-{scene}.vtu",
    log:
        "logs/meshes/{law}-{scene}.log",
    params:
        library=library("scene_mesh.py"),
        number=lambda wc: int(wc.scene),
        tolerance=config["stokes"]["tolerance"],
    script:
        "../scripts/scene_mesh.py"


rule audit:
    """Solve a sample of all laws and decades by other methods; stop where forces disagree."""
    input:
        scenes=expand("results/scenes/{shard}.h5", shard=SHARDS),
        solutions=expand("results/stokes/{shard}.h5", shard=SHARDS),
    output:
        "results/analysis/audit.csv",
    log:
        "logs/analysis/audit.log",
    benchmark:
        "benchmarks/analysis/audit.tsv"
    params:
        library=library("audit.py"),
        seed=config["seed"],
        tolerance=config["stokes"]["tolerance"],
        method=config["stokes"]["method"],
        number=config["stokes"]["audit"],
        paper=config["stokes"]["audit_paper"],
    script:
        "../scripts/audit.py"

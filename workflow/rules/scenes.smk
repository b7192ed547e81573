rule scenes:
    """Draw the scenes of a shard; each depends on the seed and its own number alone."""
    output:
        "results/scenes/{law}-{shard}.h5",
    log:
        "logs/scenes/{law}-{shard}.log",
    params:
        library=library("scenes.py"),
        seed=config["seed"],
        numbers=lambda wc: plan.shard_scenes(config, wc.law, wc.shard),
        neighbours=config["scenes"]["neighbours"],
        phi_min=config["scenes"]["phi_min"],
        phi_max=config["scenes"]["phi_max"],
    script:
        "../scripts/scenes.py"

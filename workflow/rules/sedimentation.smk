rule sedimentation:
    """Let the particles of one case settle."""
    input:
        model=lambda wc: trained(plan.force_model(config, wc.case)),
        start=lambda wc: plan.start_file(config, wc.case),
    output:
        trajectory="results/sedimentation/{case}.nc",
        series="results/sedimentation/{case}.series.nc",
    log:
        "logs/sedimentation/{case}.log",
    benchmark:
        "benchmarks/sedimentation/{case}.tsv"
    threads: config["sedimentation"]["threads"]
    # Not a parameter, because it changes no result.
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=lambda wc: settling_library(plan.force_model(config, wc.case)),
        seed=config["seed"],
        stream=lambda wc: plan.start_stream(CASES[wc.case].start),
        model=lambda wc: plan.force_model(config, wc.case),
        particles=lambda wc: CASES[wc.case].particles,
        volume_fraction=lambda wc: CASES[wc.case].volume_fraction,
        galileo_multiple=lambda wc: CASES[wc.case].galileo_multiple,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        step=config["sedimentation"]["step"],
        duration=config["sedimentation"]["duration"],
        save_every=config["sedimentation"]["save_every"],
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle.py"

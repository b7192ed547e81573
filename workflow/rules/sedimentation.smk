rule sedimentation:
    """Let the particles of one case settle among their nearest neighbours."""
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
    wildcard_constraints:
        case=rf"(?!.*_{plan.ALL_PARTICLES}\b)[\w.+-]+",
    threads: config["sedimentation"]["threads"]
    # Not a parameter, because it changes no result.
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=lambda wc: settling_library(plan.force_model(config, wc.case)),
        seed=config["seed"],
        stream=lambda wc: plan.start_stream(CASES[wc.case].start),
        model=lambda wc: plan.force_model(config, wc.case),
        neighbours=plan.neighbours(config),
        back_flow=lambda wc: CASES[wc.case].compared == plan.BACK_FLOW,
        particles=lambda wc: CASES[wc.case].particles,
        volume_fraction=lambda wc: CASES[wc.case].volume_fraction,
        galileo_multiple=lambda wc: CASES[wc.case].galileo_multiple,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        schedule=lambda wc: plan.schedule(config, wc.case),
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle.py"


rule all_particles:
    """Let the particles of one case settle, all of them coupled through the fluid."""
    input:
        start=lambda wc: plan.start_file(config, wc.case),
    output:
        trajectory="results/sedimentation/{case}.nc",
        series="results/sedimentation/{case}.series.nc",
    log:
        "logs/sedimentation/{case}.log",
    benchmark:
        "benchmarks/sedimentation/{case}.tsv"
    wildcard_constraints:
        case=rf"[\w.+-]+_{plan.ALL_PARTICLES}",
    threads: config["sedimentation"]["threads"]
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=library("settle_all_particles.py"),
        seed=config["seed"],
        stream=lambda wc: plan.start_stream(CASES[wc.case].start),
        particles=lambda wc: CASES[wc.case].particles,
        volume_fraction=lambda wc: CASES[wc.case].volume_fraction,
        galileo_multiple=lambda wc: CASES[wc.case].galileo_multiple,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        fluid=config["sedimentation"]["all_particles"]["fluid"],
        tolerance=config["sedimentation"]["all_particles"]["tolerance"],
        start=config["sedimentation"]["start"],
        schedule=plan.short_schedule(config),
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle_all_particles.py"

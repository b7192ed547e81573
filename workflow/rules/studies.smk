rule study_of_a_step:
    """Let a small cloud settle with one of the time steps that are compared."""
    input:
        model=branch(
            config["sedimentation"]["model"] in LEARNED_MODELS,
            then=f"results/model/{config['sedimentation']['model']}.safetensors",
            otherwise=[],
        ),
        start=[],
    output:
        trajectory=temp("results/studies/{case}.nc"),
        series="results/studies/{case}.series.nc",
    log:
        "logs/studies/{case}.log",
    wildcard_constraints:
        case=r"step[\d.e-]+",
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=settling_library(config["sedimentation"]["model"]),
        # The same start for each step.
        seed=config["seed"],
        stream=plan.start_stream("step"),
        model=config["sedimentation"]["model"],
        particles=config["studies"]["particles"],
        volume_fraction=config["studies"]["volume_fraction"],
        galileo_multiple=1.0,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        step=lambda wc: float(wc.case.removeprefix("step")),
        duration=config["studies"]["duration"],
        save_every=config["studies"]["duration"],
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle.py"


rule step_size:
    """Mean and variance of the settling velocity against the time step."""
    input:
        series=[f"results/studies/step{step:.15g}.series.nc" for step in config["studies"]["steps"]],
    output:
        "results/studies/step_size.csv",
    log:
        "logs/studies/step_size.log",
    params:
        library=library("step_size.py"),
        statistics_from=config["studies"]["statistics_from"],
        together=config["studies"]["together"],
    script:
        "../scripts/step_size.py"

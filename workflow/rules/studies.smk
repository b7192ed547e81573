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
        trajectory="results/studies/{case}.nc",
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
        neighbours=plan.neighbours(config),
        particles=config["studies"]["particles"],
        volume_fraction=config["studies"]["volume_fraction"],
        galileo_multiple=1.0,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        schedule=lambda wc: {
            "step": float(wc.case.removeprefix("step")),
            "duration": config["studies"]["duration"],
            "save_interval": config["studies"]["duration"],
        },
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
    localrule: True
    params:
        library=library("step_size.py"),
        statistics_from=config["studies"]["statistics_from"],
        together=config["studies"]["together"],
    script:
        "../scripts/step_size.py"


rule moving_spheres:
    """Drag at random velocities by each closure, against the multipole solver."""
    output:
        "results/studies/moving_spheres.csv",
    log:
        "logs/studies/moving_spheres.log",
    benchmark:
        "benchmarks/studies/moving_spheres.tsv"
    params:
        library=library("moving_spheres.py"),
        seed=config["seed"],
        volume_fractions=config["studies"]["moving_spheres"],
    script:
        "../scripts/moving_spheres.py"


rule paper_training:
    """Train the IDNN as the paper does: full batches, literal distances, an hour or so on one core."""
    input:
        data="results/dataset/forces.h5",
    output:
        "results/studies/paper_training.csv",
    log:
        "logs/studies/paper_training.log",
    benchmark:
        "benchmarks/studies/paper_training.tsv"
    resources:
        gpu=GPUS,
    params:
        library=library("paper_training.py"),
        seed=config["seed"],
        test_share=config["dataset"]["test_share"],
        laws=plan.laws(config, "idnn"),
        device=config["idnn"]["device"],
    script:
        "../scripts/paper_training.py"


rule study_of_neighbours:
    """Let a small cloud settle with another number of neighbours, by the Rotne-Prager inverse."""
    input:
        model=[],
        start=[],
    output:
        trajectory="results/studies/{case}_phi{phi}.nc",
        series="results/studies/{case}_phi{phi}.series.nc",
    log:
        "logs/studies/{case}_phi{phi}.log",
    wildcard_constraints:
        case=r"neighbours\d+",
        phi=r"[\d.e-]+",
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=settling_library("rotne_prager"),
        # The same start for each number.
        seed=config["seed"],
        stream=lambda wc: plan.start_stream(f"neighbours_phi{wc.phi}"),
        model="rotne_prager",
        neighbours=lambda wc: int(wc.case.removeprefix("neighbours")),
        particles=min(config["sedimentation"]["particles"]),
        volume_fraction=lambda wc: float(wc.phi),
        galileo_multiple=1.0,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        schedule=lambda wc: plan.long_schedule(config, float(wc.phi)),
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle.py"


rule neighbour_numbers:
    """Settling velocity against the number of neighbours, the paper's points beside it."""
    input:
        series=expand(
            "results/studies/neighbours{number}_phi{phi:.15g}.series.nc",
            number=config["studies"]["neighbours"],
            phi=config["studies"]["neighbours_at"],
        ),
    output:
        "results/studies/neighbour_numbers.csv",
    log:
        "logs/studies/neighbour_numbers.log",
    localrule: True
    params:
        library=library("neighbour_numbers.py"),
        starts=[
            plan.long_statistics_from(config, phi)
            for number in config["studies"]["neighbours"]
            for phi in config["studies"]["neighbours_at"]
        ],
    script:
        "../scripts/neighbour_numbers.py"


rule figure_neighbour_numbers:
    """Settling velocity against the number of neighbours, drawn."""
    input:
        table=rules.neighbour_numbers.output[0],
    output:
        **figure("neighbour_numbers", "Sedimentation"),
    log:
        "logs/figures/neighbour_numbers.log",
    localrule: True
    params:
        library=library("figure_neighbour_numbers.py"),
    script:
        "../scripts/figure_neighbour_numbers.py"


rule study_of_moving_neighbours:
    """Let a small cloud settle among neighbours that move as one, or each in its own way."""
    input:
        model=[],
        start=[],
    output:
        trajectory="results/studies/{case}_neighbours.nc",
        series="results/studies/{case}_neighbours.series.nc",
    log:
        "logs/studies/{case}_neighbours.log",
    wildcard_constraints:
        case="moving|together",
    resources:
        checkpoint_interval=config["sedimentation"]["checkpoint_interval"],
    params:
        library=settling_library("rotne_prager", "settle_moving_neighbours.py"),
        # The same start for both.
        seed=config["seed"],
        stream=plan.start_stream("moving_neighbours"),
        model="rotne_prager",
        moving=lambda wc: wc.case == "moving",
        particles=min(config["sedimentation"]["particles"]),
        volume_fraction=max(config["studies"]["neighbours_at"]),
        galileo_multiple=1.0,
        change=config["sedimentation"]["galileo"]["change"],
        properties=config["sedimentation"]["properties"],
        start=config["sedimentation"]["start"],
        schedule=plan.long_schedule(config, max(config["studies"]["neighbours_at"])),
        precision=config["sedimentation"]["precision"],
    script:
        "../scripts/settle_moving_neighbours.py"


rule moving_neighbours:
    """Velocity, its variance, close pairs and overlaps where neighbours move in their own way."""
    input:
        series=expand(rules.study_of_moving_neighbours.output.series, case=["together", "moving"]),
        trajectory=expand(
            rules.study_of_moving_neighbours.output.trajectory, case=["together", "moving"]
        ),
    output:
        "results/studies/moving_neighbours.csv",
    log:
        "logs/studies/moving_neighbours.log",
    localrule: True
    params:
        library=library("moving_neighbours.py"),
        start=plan.long_statistics_from(config, max(config["studies"]["neighbours_at"])),
    script:
        "../scripts/moving_neighbours.py"

rule prediction_benchmark:
    """Score of each force model on the paper's law against the cost of a prediction."""
    input:
        data="results/dataset/forces.h5",
        scores="results/model/evaluation.csv",
        models=expand("results/model/{model}.safetensors", model=LEARNED_MODELS),
    output:
        **figure("accuracy_vs_cost", "Force models"),
    log:
        "logs/benchmarks/prediction.log",
    params:
        library=library("prediction_benchmark.py"),
        radial_law=plan.figure_law(config),
    script:
        "../scripts/prediction_benchmark.py"


rule solver_benchmark:
    """Run time of the Stokes solver, its rungs, references and peers against the error."""
    output:
        error="results/benchmarks/solver.csv",
        picture="results/benchmarks/solver.png",
        print="results/benchmarks/solver.pdf",
        spheres="results/benchmarks/spheres.csv",
    log:
        "logs/benchmarks/solver.log",
    params:
        library=library("solver_benchmark.py"),
        seed=config["seed"],
        phi_min=config["scenes"]["phi_min"],
        phi_max=config["scenes"]["phi_max"],
        scenes=config["benchmarks"]["scenes"],
        few=config["benchmarks"]["few"],
        tolerances=config["benchmarks"]["tolerances"],
        spheres=config["benchmarks"]["spheres"],
    script:
        "../scripts/solver_benchmark.py"


rule moving_benchmark:
    """Run time of the solver of moving spheres, a reference and peers against the error."""
    output:
        error="results/benchmarks/moving.csv",
        picture="results/benchmarks/moving.png",
        print="results/benchmarks/moving.pdf",
    log:
        "logs/benchmarks/moving.log",
    params:
        library=library("moving_benchmark.py"),
        seed=config["seed"],
        scenes=config["benchmarks"]["scenes"],
        few=config["benchmarks"]["few"],
        tolerances=config["benchmarks"]["tolerances"],
    script:
        "../scripts/moving_benchmark.py"


rule moving_estimates:
    """Errors of random clusters of moving spheres by a reference, beside the solver's estimates."""
    output:
        "results/benchmarks/moving_estimates.csv",
    log:
        "logs/benchmarks/moving_estimates.log",
    params:
        library=library("moving_estimates.py"),
        seed=config["seed"],
        scenes=config["benchmarks"]["scenes"],
    script:
        "../scripts/moving_estimates.py"


rule moving_cost:
    """Time and memory of the velocities of clouds that settle, by their number of spheres."""
    output:
        "results/benchmarks/moving_cost.csv",
    log:
        "logs/benchmarks/moving_cost.log",
    params:
        library=library("moving_cost.py"),
        seed=config["seed"],
        spheres=config["benchmarks"]["spheres"],
    script:
        "../scripts/moving_cost.py"


rule settling_benchmark:
    """Seconds a step and memory of clouds, by their number of particles."""
    output:
        "results/benchmarks/settling.csv",
    log:
        "logs/benchmarks/settling.log",
    # Not for the scheduler alone: what is timed on two threads has two cores.
    threads: max(config["benchmarks"]["threads"])
    params:
        library=library("settling_benchmark.py"),
        seed=config["seed"],
        particles=config["benchmarks"]["particles"],
        volume_fraction=config["benchmarks"]["volume_fraction"],
        threads=config["benchmarks"]["threads"],
    script:
        "../scripts/settling_benchmark.py"


rule stress:
    """Gaps, crowds, distances, turns and condition numbers that strain the solver."""
    output:
        "results/benchmarks/stress.csv",
    log:
        "logs/benchmarks/stress.log",
    params:
        library=library("stress.py"),
        seed=config["seed"],
        tolerances=config["benchmarks"]["tolerances"],
        crowds=config["benchmarks"]["crowds"],
    script:
        "../scripts/stress.py"

rule solver_benchmark:
    """Run time of the Stokes solver against the error of the force."""
    input:
        operator=f"results/operators/{TEMPLATE}.h5",
        library=library("solver_benchmark.py"),
    output:
        "results/benchmarks/{law}.csv",
    log:
        "logs/benchmarks/{law}.log",
    params:
        seed=config["seed"],
        law=lambda wc: wc.law,
        scenes=config["benchmarks"]["scenes"],
        phi_min=config["scenes"]["phi_min"],
        phi_max=config["scenes"]["phi_max"],
        tolerances=config["benchmarks"]["tolerances"],
    script:
        "../scripts/solver_benchmark.py"

rule data_summary:
    """What the paper states of its forces, and all rank correlations, for each radial law."""
    input:
        data="results/dataset/forces.h5",
    output:
        json="results/dataset/summary.json",
        forces="results/analysis/force_summary.csv",
    log:
        "logs/data_summary.log",
    localrule: True
    params:
        library=library("data_summary.py"),
        radial_law=plan.figure_law(config),
    script:
        "../scripts/data_summary.py"


rule mesh_study:
    """Drag on an isolated sphere against mesh size, for each discretisation."""
    output:
        study="results/analysis/mesh_study.csv",
        convergence="results/analysis/grid_convergence.csv",
    log:
        "logs/analysis/mesh_study.log",
    benchmark:
        "benchmarks/analysis/mesh_study.tsv"
    params:
        library=library("mesh_study.py"),
        sizes=config["meshing"]["study_sizes"],
    script:
        "../scripts/mesh_study.py"


rule steady_state:
    """Average every case over its steady state."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=SETTLED_CASES),
    output:
        "results/analysis/steady_state.csv",
    log:
        "logs/analysis/steady_state.log",
    localrule: True
    params:
        library=library("steady_state.py"),
        starts=[plan.statistics_from(config, case) for case in SETTLED_CASES],
    script:
        "../scripts/steady_state.py"


rule independence_of_n:
    """Test whether the averages depend on the number of particles."""
    input:
        steady="results/analysis/steady_state.csv",
    output:
        "results/analysis/independence_of_n.csv",
    log:
        "logs/analysis/independence_of_n.log",
    localrule: True
    params:
        library=library("independence_of_n.py"),
    script:
        "../scripts/independence_of_n.py"


rule neighbour_changes:
    """Count how often the nearest neighbours change."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=NEIGHBOUR_CASES),
    output:
        "results/analysis/neighbour_changes.csv",
    log:
        "logs/analysis/neighbour_changes.log",
    localrule: True
    params:
        library=library("neighbour_changes.py"),
        starts=[plan.statistics_from(config, case) for case in NEIGHBOUR_CASES],
    script:
        "../scripts/neighbour_changes.py"


rule local_volume_fraction:
    """Volume fraction around each particle by its fifth neighbour, at the start and when steady."""
    input:
        trajectories=expand("results/sedimentation/{case}.nc", case=SETTLED_LARGEST_CASES),
        # Data of one's own tell themselves how dense they are.
        data="results/dataset/forces.h5" if config["dataset"]["file"] else [],
    output:
        "results/analysis/local_volume_fraction.csv",
    log:
        "logs/analysis/local_volume_fraction.log",
    localrule: True
    params:
        library=library("local_volume_fraction.py"),
        starts=[plan.statistics_from(config, case) for case in SETTLED_LARGEST_CASES],
        densest=None if config["dataset"]["file"] else config["scenes"]["phi_max"],
    script:
        "../scripts/local_volume_fraction.py"


rule voronoi_cells:
    """Volumes of the Voronoi cells in some frames of a case."""
    input:
        trajectory="results/sedimentation/{case}.nc",
    output:
        "results/analysis/voronoi/{case}.nc",
    log:
        "logs/analysis/voronoi/{case}.log",
    benchmark:
        "benchmarks/analysis/voronoi/{case}.tsv"
    params:
        library=library("voronoi_cells.py"),
        statistics_from=lambda wc: plan.statistics_from(config, wc.case),
        snapshots=config["figures"]["snapshots"],
    script:
        "../scripts/voronoi_cells.py"


rule random_spheres:
    """Voronoi volumes of random spheres, to compare the settling ones with."""
    output:
        "results/analysis/random_spheres.csv",
    log:
        "logs/analysis/random_spheres.log",
    benchmark:
        "benchmarks/analysis/random_spheres.tsv"
    params:
        library=library("random_spheres.py"),
        seed=config["seed"],
        volume_fractions=config["sedimentation"]["volume_fractions"],
    script:
        "../scripts/random_spheres.py"

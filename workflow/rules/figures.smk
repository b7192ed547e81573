rule figure_force_scatter:
    """Force components against volume fraction."""
    input:
        data="results/dataset/forces.h5",
    output:
        **figure("force_scatter", "Data set"),
    log:
        "logs/figures/force_scatter.log",
    localrule: True
    params:
        library=library("figure_force_scatter.py"),
        radial_law=plan.figure_law(config),
        samples=config["figures"]["samples"],
    script:
        "../scripts/figure_force_scatter.py"


rule figure_force_pdf:
    """P.d.f. of the force in slices about powers of ten of the volume fraction."""
    input:
        data="results/dataset/forces.h5",
    output:
        **figure("force_pdf", "Data set"),
    log:
        "logs/figures/force_pdf.log",
    localrule: True
    params:
        library=library("figure_force_pdf.py"),
        radial_law=plan.figure_law(config),
    script:
        "../scripts/figure_force_pdf.py"


rule figure_spearman:
    """Rank correlation of neighbour coordinates with the force."""
    input:
        data="results/dataset/forces.h5",
    output:
        **figure("spearman", "Data set"),
    log:
        "logs/figures/spearman.log",
    localrule: True
    params:
        library=library("figure_spearman.py"),
        radial_law=plan.figure_law(config),
    script:
        "../scripts/figure_spearman.py"


rule figure_predicted_vs_target:
    """Predicted against target force on scenes that no model was trained on."""
    input:
        predictions="results/model/predictions.h5",
    output:
        **figure("predicted_vs_target", "Force models"),
    log:
        "logs/figures/predicted_vs_target.log",
    localrule: True
    params:
        library=library("figure_predicted_vs_target.py"),
        radial_law=plan.figure_law(config),
        samples=config["figures"]["samples"],
    script:
        "../scripts/figure_predicted_vs_target.py"


rule figure_error_by_distance:
    """Error of the force models against the gap to the nearest neighbour."""
    input:
        predictions="results/model/predictions.h5",
    output:
        **figure("error_by_distance", "Force models"),
    log:
        "logs/figures/error_by_distance.log",
    localrule: True
    params:
        library=library("figure_error_by_distance.py"),
    script:
        "../scripts/figure_error_by_distance.py"


rule figure_learning_curve:
    """What is left unexplained against the number of training scenes."""
    input:
        table="results/model/learning_curve.csv",
    output:
        **figure("learning_curve", "Force models"),
    log:
        "logs/figures/learning_curve.log",
    localrule: True
    params:
        library=library("figure_learning_curve.py"),
    script:
        "../scripts/figure_learning_curve.py"


rule figure_inverse_beta:
    """Steady settling velocity against volume fraction."""
    input:
        steady="results/analysis/steady_state.csv",
    output:
        **figure("inverse_beta", "Sedimentation"),
    log:
        "logs/figures/inverse_beta.log",
    localrule: True
    params:
        library=library("figure_inverse_beta.py"),
    script:
        "../scripts/figure_inverse_beta.py"


rule figure_settling_in_time:
    """Mean and variance of the settling velocity in time."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=PLAIN_CASES),
        long=expand("results/sedimentation/{case}.series.nc", case=LONG_CASES),
    output:
        **figure("settling_in_time", "Sedimentation"),
    log:
        "logs/figures/settling_in_time.log",
    localrule: True
    params:
        library=library("figure_settling_in_time.py"),
    script:
        "../scripts/figure_settling_in_time.py"


rule figure_phase_and_spectra:
    """Phase diagrams and energy spectra of the tracked particles."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=LARGEST_CASES),
    output:
        **figure("phase_and_spectra", "Sedimentation"),
    log:
        "logs/figures/phase_and_spectra.log",
    localrule: True
    params:
        library=library("figure_phase_and_spectra.py"),
        statistics_from=config["sedimentation"]["statistics_from"],
        fit_frequencies=config["figures"]["fit_frequencies"],
        spectrum=config["figures"]["spectrum"],
        units=config["figures"]["units"],
    script:
        "../scripts/figure_phase_and_spectra.py"


rule figure_cloud_spectra:
    """Energy spectra averaged over all particles, with and without a window."""
    input:
        trajectories=expand("results/sedimentation/{case}.nc", case=SETTLED_LARGEST_CASES),
    output:
        **figure("cloud_spectra", "Sedimentation"),
    log:
        "logs/figures/cloud_spectra.log",
    localrule: True
    params:
        library=library("figure_cloud_spectra.py"),
        starts=[plan.statistics_from(config, case) for case in SETTLED_LARGEST_CASES],
        fit_frequencies=config["figures"]["fit_frequencies"],
        units=config["figures"]["units"],
    script:
        "../scripts/figure_cloud_spectra.py"


rule figure_ergodicity:
    """Time average against ensemble average of the settling velocity."""
    input:
        trajectories=expand("results/sedimentation/{case}.nc", case=SETTLED_LARGEST_CASES),
    output:
        **figure("ergodicity", "Sedimentation"),
    log:
        "logs/figures/ergodicity.log",
    localrule: True
    params:
        library=library("figure_ergodicity.py"),
        starts=[plan.statistics_from(config, case) for case in SETTLED_LARGEST_CASES],
    script:
        "../scripts/figure_ergodicity.py"


rule figure_lifetimes:
    """How long particles keep their velocity and their place in a cluster."""
    input:
        trajectories=expand("results/sedimentation/{case}.nc", case=SETTLED_LARGEST_CASES),
    output:
        **figure("lifetimes", "Sedimentation"),
    log:
        "logs/figures/lifetimes.log",
    benchmark:
        "benchmarks/figures/lifetimes.tsv"
    localrule: True
    params:
        library=library("figure_lifetimes.py"),
        starts=[plan.statistics_from(config, case) for case in SETTLED_LARGEST_CASES],
    script:
        "../scripts/figure_lifetimes.py"


rule figure_closures:
    """Five neighbours and all particles, in boxes of several sizes, at the densest phi."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=plan.compared_closures(config)),
        trajectories=expand("results/sedimentation/{case}.nc", case=plan.compared_closures(config)),
        cells=expand("results/analysis/voronoi/{case}.nc", case=plan.compared_closures(config)),
    output:
        **figure("closures", "All particles"),
    log:
        "logs/figures/closures.log",
    localrule: True
    params:
        library=library("figure_closures.py"),
        seed=config["seed"],
        statistics_from=config["sedimentation"]["statistics_from"],
    script:
        "../scripts/figure_closures.py"


rule figure_trajectories_all_particles:
    """Paths of the tracked particles where all feel each other."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=TOGETHER_CASES),
    output:
        **figure("trajectories_all_particles", "All particles"),
    log:
        "logs/figures/trajectories_all_particles.log",
    localrule: True
    params:
        library=library("figure_trajectories.py"),
    script:
        "../scripts/figure_trajectories.py"


rule figure_trajectories:
    """Paths of the tracked particles, unwrapped."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=LARGEST_CASES),
    output:
        **figure("trajectories", "Sedimentation"),
    log:
        "logs/figures/trajectories.log",
    localrule: True
    params:
        library=library("figure_trajectories.py"),
    script:
        "../scripts/figure_trajectories.py"


rule figure_trajectories_3d:
    """The same paths in space."""
    input:
        series=expand("results/sedimentation/{case}.series.nc", case=LARGEST_CASES),
    output:
        **figure("trajectories_3d", "Sedimentation"),
    log:
        "logs/figures/trajectories_3d.log",
    localrule: True
    params:
        library=library("figure_trajectories_3d.py"),
    script:
        "../scripts/figure_trajectories_3d.py"


rule movie:
    """A slab of the densest cloud as it settles, coloured by velocity."""
    input:
        trajectory=f"results/sedimentation/{GALILEO_CASES[0]}.nc",
    output:
        reported("results/figures/settling_cloud.gif", "settling_cloud", "Sedimentation", "film"),
    log:
        "logs/figures/settling_cloud.log",
    benchmark:
        "benchmarks/figures/settling_cloud.tsv"
    localrule: True
    params:
        library=library("movie.py"),
        pictures=config["figures"]["movie_pictures"],
    script:
        "../scripts/movie.py"


rule figure_voronoi_pdf:
    """P.d.f. of Voronoi volumes at each Galileo number."""
    input:
        cells=expand("results/analysis/voronoi/{case}.nc", case=GALILEO_CASES),
    output:
        **figure("voronoi_pdf", "Sedimentation"),
    log:
        "logs/figures/voronoi_pdf.log",
    benchmark:
        "benchmarks/figures/voronoi_pdf.tsv"
    localrule: True
    params:
        library=library("figure_voronoi_pdf.py"),
        seed=config["seed"],
    script:
        "../scripts/figure_voronoi_pdf.py"


rule figure_voronoi_variance:
    """Variance of Voronoi volumes against settling velocity."""
    input:
        steady="results/analysis/steady_state.csv",
        spheres="results/analysis/random_spheres.csv",
        cells=expand("results/analysis/voronoi/{case}.nc", case=SETTLED_PLAIN_CASES),
    output:
        **figure("voronoi_variance", "Sedimentation"),
    log:
        "logs/figures/voronoi_variance.log",
    benchmark:
        "benchmarks/figures/voronoi_variance.tsv"
    localrule: True
    params:
        library=library("figure_voronoi_variance.py"),
        seed=config["seed"],
    script:
        "../scripts/figure_voronoi_variance.py"


rule figure_frozen_cloud:
    """Five neighbours against all particles in frozen random clouds."""
    output:
        **figure("frozen_cloud", "Sedimentation"),
    log:
        "logs/figures/frozen_cloud.log",
    benchmark:
        "benchmarks/figures/frozen_cloud.tsv"
    params:
        library=library("figure_frozen_cloud.py"),
        seed=config["seed"],
        volume_fractions=config["sedimentation"]["volume_fractions"],
        particles=config["figures"]["frozen_cloud"]["particles"],
        clouds=config["figures"]["frozen_cloud"]["clouds"],
    script:
        "../scripts/figure_frozen_cloud.py"


rule figure_mesh_study:
    """Drag on an isolated sphere against mesh size."""
    input:
        study="results/analysis/mesh_study.csv",
    output:
        **figure("mesh_study", "Stokes solver"),
    log:
        "logs/figures/mesh_study.log",
    localrule: True
    params:
        library=library("figure_mesh_study.py"),
    script:
        "../scripts/figure_mesh_study.py"


rule figure_audit:
    """Difference of the forces of the audit beside both error estimates."""
    input:
        audit="results/analysis/audit.csv",
    output:
        **figure("audit", "Stokes solver"),
    log:
        "logs/figures/audit.log",
    localrule: True
    params:
        library=library("figure_audit.py"),
    script:
        "../scripts/figure_audit.py"


rule figure_scene_meshes:
    """Meshes of a dense scene and of a near contact, coloured by pressure."""
    input:
        scenes=expand("results/scenes/{shard}.h5", shard=plan.first_shards(config)),
    output:
        **figure("scene_meshes", "Stokes solver"),
    log:
        "logs/figures/scene_meshes.log",
    localrule: True
    params:
        library=library("figure_scene_meshes.py"),
        tolerance=config["stokes"]["tolerance"],
    script:
        "../scripts/figure_scene_meshes.py"


rule figure_sketches:
    """Sketches of a scene, of the IDNN and of a particle's own frame."""
    input:
        model="results/model/idnn.safetensors",
    output:
        **figure("sketches", "Force models"),
    log:
        "logs/figures/sketches.log",
    localrule: True
    params:
        library=library("figure_sketches.py"),
    script:
        "../scripts/figure_sketches.py"

# What the files of rules share. Jobs of seconds are local: where others go to a cluster they run
# beside Snakemake.


wildcard_constraints:
    law="|".join(config["scenes"]["number"]),
    shard=r"\d+",
    scene=r"\d+",
    component="streamwise|lateral",
    model="[a-z_]+",
    layers=r"[\d-]+(_[\d-]+)?",
    number=r"\d+|all",


def library(script):
    """Digest of the library files that `workflow/scripts/<script>` runs, a parameter of its job.

    As inputs they would rerun the job as well, and fill the terminal.
    """
    return digest(library_files(ROOT / "workflow" / "scripts" / script))


def settling_library(model, script="settle.py"):
    """Digest of the library files that settling with a force model runs: with its formula's."""
    files = library_files(ROOT / "workflow" / "scripts" / script)
    if model not in LEARNED_MODELS:
        formula = f"dustfall/forces/formulas/{model}.py"
        files = sorted({*files, formula, *library_files(ROOT / formula)})
    return digest(files)


# What the report calls figures and tables, and the heading that they stand under; others have the
# name of their file.
TITLES = {
    "mesh_study": ("Meshes", "Drag against mesh size"),
    "scene_meshes": ("Meshes", "Meshes of two scenes"),
    "audit": ("Accuracy", "Two methods compared"),
    "dataset": ("Scenes", "Scenes and forces by decade"),
    "force_summary": ("Forces", "What the paper states of its forces"),
    "force_scatter": ("Forces", "Force against volume fraction"),
    "force_pdf": ("Forces", "Densities of the force"),
    "spearman": ("Forces", "Rank correlation with the neighbours"),
    "sketches": ("Choice", "Scene, network and frames"),
    "sweep": ("Choice", "Cross-validation of the layers"),
    "learning_curve": ("Choice", "Scores against training scenes"),
    "ablation": ("Choice", "What each change brings"),
    "evaluation": ("Scores", "Scores on test scenes"),
    "symmetries": ("Scores", "Broken symmetries"),
    "predicted_vs_target": ("Scores", "Predicted against target force"),
    "error_by_distance": ("Scores", "Error against the nearest gap"),
    "accuracy_vs_cost": ("Scores", "Score against run time"),
    "steady_state": ("Averages", "Averages of the steady state"),
    "inverse_beta": ("Averages", "Settling velocity against volume fraction"),
    "independence_of_n": ("Averages", "Dependence on the number of particles"),
    "neighbour_changes": ("Averages", "Changes of neighbours"),
    "neighbour_numbers": ("Averages", "How many neighbours"),
    "frozen_cloud": ("Averages", "Frozen clouds: five neighbours and all"),
    "settling_in_time": ("In time", "Mean and variance in time"),
    "trajectories": ("In time", "Paths of three particles"),
    "trajectories_3d": ("In time", "Paths in space"),
    "settling_cloud": ("In time", "A cloud as it settles"),
    "phase_and_spectra": ("Fluctuations", "Phase diagrams and spectra"),
    "cloud_spectra": ("Fluctuations", "Spectra of all particles"),
    "lifetimes": ("Fluctuations", "How long velocities and clusters last"),
    "ergodicity": ("Fluctuations", "Time and ensemble averages"),
    "openfoam_settling": ("In time", "OpenFOAM and dustfall"),
    "local_volume_fraction": ("Clustering", "Volume fraction around the particles"),
    "closures": ("Comparison", "Five neighbours and all particles"),
    "trajectories_all_particles": ("In time", "Paths where all particles feel each other"),
    "voronoi_pdf": ("Clustering", "Densities of Voronoi volumes"),
    "voronoi_variance": ("Clustering", "Variance of Voronoi volumes"),
}


def reported(path, name, category, kind):
    """A file that the report shows, with its caption, heading and title."""
    heading, title = TITLES.get(name, (kind.capitalize(), name.replace("_", " ")))
    return report(
        path,
        category=category,
        subcategory=heading,
        labels={kind: title},
        caption=f"../report/{name}.rst",
    )


def figure(name, category):
    """Outputs of a figure: the picture for the report, the one for print, the numbers drawn."""
    stem = f"results/figures/{name}"
    return {
        "png": reported(f"{stem}.png", name, category, "figure"),
        "pdf": f"{stem}.pdf",
        "csv": f"{stem}.csv",
    }


# Tables that the report shows: the file of each, and its category.
TABLES = {
    "audit": ("results/analysis/audit.csv", "Stokes solver"),
    "dataset": ("results/dataset/summary.csv", "Data set"),
    "force_summary": ("results/analysis/force_summary.csv", "Data set"),
    "sweep": ("results/sweep/summary.csv", "Force models"),
    "learning_curve": ("results/model/learning_curve.csv", "Force models"),
    "ablation": ("results/model/ablation.csv", "Force models"),
    "evaluation": ("results/model/evaluation.csv", "Force models"),
    "symmetries": ("results/model/symmetries.csv", "Force models"),
    "steady_state": ("results/analysis/steady_state.csv", "Sedimentation"),
    "independence_of_n": ("results/analysis/independence_of_n.csv", "Sedimentation"),
    "neighbour_changes": ("results/analysis/neighbour_changes.csv", "Sedimentation"),
    "local_volume_fraction": ("results/analysis/local_volume_fraction.csv", "Sedimentation"),
}
if config["dataset"]["file"]:
    del TABLES["audit"]

SHARDS = plan.shards(config)
TRIALS = plan.trials(config)
MESHES = expand(
    "results/meshes/{scene}.{ending}", scene=plan.kept_meshes(config), ending=["msh", "vtu"]
)
# What tells of the solver, and belongs to no data set of one's own.
SOLVER = (
    []
    if config["dataset"]["file"]
    else ["results/analysis/audit.csv", "results/analysis/grid_convergence.csv", *MESHES]
)
SOLVER_FIGURES = [] if config["dataset"]["file"] else ["mesh_study", "audit", "scene_meshes"]
CASES = plan.cases(config)

# The cases that tell the steady state, and those of them among nearest neighbours; the cases of
# `sedimentation.model` at the Galileo number of the properties that last as long as the paper's,
# and those that tell the steady state; of either those with most particles, from dilute to dense;
# the largest clouds of which all particles feel each other; and the cases that differ in the
# Galileo number alone.
SETTLED_CASES = plan.settled_cases(config)
NEIGHBOUR_CASES = [name for name in SETTLED_CASES if CASES[name].compared != plan.ALL_PARTICLES]
PLAIN_CASES = [name for name in CASES if plan.is_plain(CASES[name]) and not CASES[name].long]
LONG_CASES = [name for name in CASES if plan.is_plain(CASES[name]) and CASES[name].long]
SETTLED_PLAIN_CASES = [name for name in SETTLED_CASES if plan.is_plain(CASES[name])]
LARGEST_CASES = plan.largest_cases(config, [])
SETTLED_LARGEST_CASES = plan.largest_cases(config, config["sedimentation"]["long"]["particles"])
TOGETHER_CASES = [
    plan.Case(n, phi, 1.0, compared=plan.ALL_PARTICLES).name
    for n in config["sedimentation"]["all_particles"]["particles"][-1:]
    for phi in sorted(config["sedimentation"]["volume_fractions"])
]
GALILEO_CASES = [
    name
    for name, case in CASES.items()
    if not (case.compared or case.long)
    and case.particles == config["sedimentation"]["galileo"]["particles"]
    and case.volume_fraction == config["sedimentation"]["galileo"]["volume_fraction"]
]

# Force models that are trained; the others need no file.
LEARNED_MODELS = trained_models()


def trained(model):
    """File of a force model that is trained; nothing of another."""
    return f"results/model/{model}.safetensors" if model in LEARNED_MODELS else []


# Graphics cards that training asks of a cluster for.
GPUS = 1 if config["idnn"]["device"] == "cuda" else 0


FIGURES = expand(
    "results/figures/{figure}.{ending}",
    figure=[
        "force_scatter",
        "force_pdf",
        "spearman",
        "predicted_vs_target",
        "error_by_distance",
        "learning_curve",
        "inverse_beta",
        "settling_in_time",
        "phase_and_spectra",
        "voronoi_pdf",
        "voronoi_variance",
        "cloud_spectra",
        "ergodicity",
        "lifetimes",
        "closures",
        "trajectories",
        "trajectories_3d",
        "frozen_cloud",
        "sketches",
        *SOLVER_FIGURES,
        *["trajectories_all_particles"] * bool(TOGETHER_CASES),
    ],
    ending=["png", "pdf", "csv"],
) + ["results/figures/settling_cloud.gif"]

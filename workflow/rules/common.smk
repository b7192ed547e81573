# What the rule files share.


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


def settling_library(model):
    """Digest of the library files that settling with a force model runs: with its formula's."""
    files = library_files(ROOT / "workflow" / "scripts" / "settle.py")
    if model not in LEARNED_MODELS:
        formula = f"dustfall/forces/formulas/{model}.py"
        files = sorted({*files, formula, *library_files(ROOT / formula)})
    return digest(files)


def figure(name, category):
    """Outputs of a figure: the picture for the report, the one for print, the numbers drawn."""
    stem = f"results/figures/{name}"
    caption = f"../report/{name}.rst"
    return {
        "png": report(f"{stem}.png", category=category, caption=caption),
        "pdf": f"{stem}.pdf",
        "csv": f"{stem}.csv",
    }


SHARDS = plan.shards(config)
TRIALS = plan.trials(config)
MESHES = expand(
    "results/meshes/{scene}.{ending}", scene=plan.kept_meshes(config), ending=["msh", "vtu"]
)
# What tells of the solver, and belongs to no data set of one's own.
SOLVER = [] if config["dataset"]["file"] else ["results/analysis/audit.csv", *MESHES]
SOLVER_FIGURES = [] if config["dataset"]["file"] else ["mesh_study", "audit", "scene_meshes"]
CASES = plan.cases(config)

# The cases that tell the steady state, and those of them among nearest neighbours; the cases of
# `sedimentation.model` at the Galileo number of the properties that last as long as the paper's,
# and those that tell the steady state; of either those with most particles, from dilute to dense;
# and the cases that differ in the Galileo number alone.
SETTLED_CASES = plan.settled_cases(config)
NEIGHBOUR_CASES = [name for name in SETTLED_CASES if CASES[name].compared != plan.ALL_PARTICLES]
PLAIN_CASES = [name for name in CASES if plan.is_plain(CASES[name]) and not CASES[name].long]
LONG_CASES = [name for name in CASES if plan.is_plain(CASES[name]) and CASES[name].long]
SETTLED_PLAIN_CASES = [name for name in SETTLED_CASES if plan.is_plain(CASES[name])]
LARGEST_CASES = plan.largest_cases(config, [])
SETTLED_LARGEST_CASES = plan.largest_cases(config, config["sedimentation"]["long"]["particles"])
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
        "trajectories",
        "trajectories_3d",
        "frozen_cloud",
        *SOLVER_FIGURES,
    ],
    ending=["png", "pdf", "csv"],
) + ["results/figures/settling_cloud.gif"]

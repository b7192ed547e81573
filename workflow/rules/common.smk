# What the rule files share.


wildcard_constraints:
    law="uniform|ball|contact",
    shard=r"\d+",
    component="streamwise|lateral",
    model="[a-z_]+",
    layers=r"[\d-]+(_[\d-]+)?",
    number=r"\d+|all",


def library(script):
    """Library files that `workflow/scripts/<script>` runs, as inputs of its job."""
    root = os.path.relpath(ROOT)
    files = library_files(ROOT / "workflow" / "scripts" / script)
    return [os.path.normpath(os.path.join(root, file)) for file in files]


def settling_library(model):
    """Library files that settling with a force model runs: those of its formula, if it is one."""
    files = library("settle.py")
    formula = ROOT / "dustfall" / "forces" / "formulas" / f"{model}.py"
    if model not in LEARNED_MODELS:
        own = [formula, *(ROOT / file for file in library_files(formula))]
        files = sorted({*files, *(os.path.relpath(file) for file in own)})
    return files


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
CASES = plan.cases(config)

# The cases of `sedimentation.model` at the Galileo number of the properties; those of them with most
# particles, from dilute to dense and from one start each; and the cases that differ in the Galileo
# number alone.
PLAIN_CASES = [
    name for name, case in CASES.items() if case.galileo_multiple == 1 and not case.compared_model
]
LARGEST_CASES = [
    name
    for name in sorted(PLAIN_CASES, key=lambda name: CASES[name].volume_fraction)
    if CASES[name].particles == max(config["sedimentation"]["particles"])
    and CASES[name].volume_fraction in config["sedimentation"]["volume_fractions"]
    and CASES[name].seed == 1
]
GALILEO_CASES = [
    name
    for name, case in CASES.items()
    if not case.compared_model
    and case.particles == config["sedimentation"]["galileo"]["particles"]
    and case.volume_fraction == config["sedimentation"]["galileo"]["volume_fraction"]
]

# Force models that are trained; the others need no file.
LEARNED_MODELS = trained_models()


def trained(model):
    """File of a force model that is trained; nothing of another."""
    return f"results/model/{model}.safetensors" if model in LEARNED_MODELS else []


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
        "mesh_study",
    ],
    ending=["png", "pdf", "csv"],
) + ["results/figures/settling_cloud.gif"]

# The page of the docs that holds the campaign's numbers, and the tables and pictures beside it.


# Parts that a campaign may have or not: what is missing here has no section in the page.
FURTHER = [
    "results/benchmarks/moving.csv",
    "results/benchmarks/moving_cost.csv",
    "results/benchmarks/moving_estimates.csv",
    "results/benchmarks/settling.csv",
    "results/benchmarks/solver.csv",
    "results/benchmarks/spheres.csv",
    "results/benchmarks/stress.csv",
    "results/figures/accuracy_vs_cost.csv",
    "results/studies/moving_spheres.csv",
    "results/studies/neighbour_numbers.csv",
    "results/studies/paper_training.csv",
    "results/studies/step_size.csv",
]


rule validation:
    """Write this campaign's numbers into docs/: no part of `all`, as it changes the project."""
    input:
        # With data of one's own it is refused, which nothing has to be made for.
        campaign=[] if config["dataset"]["file"] else rules.all.input,
        further=[file for file in FURTHER if os.path.exists(file) and not config["dataset"]["file"]],
        templates=sorted((ROOT / "docs").glob("*.md.jinja")),
    # Without an output it runs whenever it is asked for: the page at hand may be of another campaign.
    log:
        "logs/validation.log",
    params:
        docs="docs",
        own_data=config["dataset"]["file"],
        configuration=", ".join(os.path.relpath(file) for file in workflow.configfiles),
    script:
        "../scripts/validation.py"

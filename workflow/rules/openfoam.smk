# What the plugin is built from, and beside it what a case is a copy of. No pattern reaches into the
# folders that a build fills.
PLUGIN = named_by("cpp/dustfall/*", "openfoam/*", "openfoam/Make/*", "openfoam/foundation/Make/*")
CASE = named_by("openfoam/cases/settling/**/*")


rule openfoam_settling:
    """The same cloud in OpenFOAM, by the plugin of `make openfoam`, and in this package."""
    output:
        **figure("openfoam_settling", "Sedimentation"),
    log:
        "logs/figures/openfoam_settling.log",
    localrule: True
    params:
        library=library("openfoam_settling.py"),
        sources=PLUGIN,
        plugin=digest([*PLUGIN, *CASE]),
        seed=config["seed"],
        stream=plan.start_stream("openfoam"),
        particles=config["studies"]["particles"],
        volume_fraction=config["studies"]["volume_fraction"],
        duration=config["studies"]["duration"],
        step=config["sedimentation"]["step"],
        properties=config["sedimentation"]["properties"],
    script:
        "../scripts/openfoam_settling.py"

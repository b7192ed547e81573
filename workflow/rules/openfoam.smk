rule openfoam_settling:
    """The same cloud in OpenFOAM, by the plugin of `make openfoam`, and in this package."""
    output:
        **figure("openfoam_settling", "Sedimentation"),
    log:
        "logs/figures/openfoam_settling.log",
    localrule: True
    params:
        library=library("openfoam_settling.py"),
        plugin=digest(
            sorted(
                path.relative_to(ROOT).as_posix()
                for folder in ("cpp/dustfall", "openfoam/cases", "openfoam")
                for path in (ROOT / folder).glob("*.[pChH]*")
            )
        ),
        seed=config["seed"],
        stream=plan.start_stream("openfoam"),
        particles=config["studies"]["particles"],
        volume_fraction=config["studies"]["volume_fraction"],
        duration=config["studies"]["duration"],
        step=config["sedimentation"]["step"],
        properties=config["sedimentation"]["properties"],
    script:
        "../scripts/openfoam_settling.py"

rule export:
    """Put the frames of a trajectory into one file that ParaView opens."""
    input:
        trajectory="results/sedimentation/{case}.nc",
        library=library("export.py"),
    output:
        "results/exports/{case}.vtkhdf",
    log:
        "logs/exports/{case}.log",
    params:
        positions=config["exports"]["positions"],
    script:
        "../scripts/export.py"

rule export:
    """Put the frames of a trajectory into one file that ParaView opens."""
    input:
        trajectory="results/sedimentation/{case}.nc",
    output:
        "results/exports/{case}.vtkhdf",
    log:
        "logs/exports/{case}.log",
    params:
        library=library("export.py"),
        positions=config["exports"]["positions"],
    script:
        "../scripts/export.py"

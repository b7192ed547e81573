rule own_data:
    """Check a data set of one's own, in place of scenes and their solution."""
    input:
        file=config["dataset"]["file"],
    output:
        data="results/dataset/forces.h5",
        summary="results/dataset/summary.csv",
    log:
        "logs/dataset.log",
    params:
        library=library("own_data.py"),
    script:
        "../scripts/own_data.py"

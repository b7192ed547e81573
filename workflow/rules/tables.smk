rule tables:
    """Tables as pages that the report shows."""
    input:
        **{name: path for name, (path, _) in TABLES.items()},
    output:
        **{
            name: reported(f"results/tables/{name}.html", name, category, "table")
            for name, (_, category) in TABLES.items()
        },
    log:
        "logs/tables.log",
    localrule: True
    script:
        "../scripts/tables.py"

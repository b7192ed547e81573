TEMPLATE = "sphere-{}".format(config["meshing"]["template_size"])


rule scenes:
    """Draw the scenes of a shard; each hangs on the seed and its own number alone."""
    input:
        library=library("scenes.py"),
    output:
        "results/scenes/{law}-{shard}.h5",
    log:
        "logs/scenes/{law}-{shard}.log",
    params:
        seed=config["seed"],
        numbers=lambda wc: plan.shard_scenes(config, wc.law, wc.shard),
        phi_min=config["scenes"]["phi_min"],
        phi_max=config["scenes"]["phi_max"],
    script:
        "../scripts/scenes.py"


rule templates:
    """Mesh the sphere with gmsh at one edge length."""
    input:
        library=library("templates.py"),
    output:
        "results/templates/sphere-{size}.h5",
    log:
        "logs/templates/sphere-{size}.log",
    script:
        "../scripts/templates.py"


rule meshes:
    """Place the template in the scenes of a shard and choose what every pair exchanges."""
    input:
        scenes="results/scenes/{law}-{shard}.h5",
        template=f"results/templates/{TEMPLATE}.h5",
        library=library("meshes.py"),
    output:
        "results/meshes/{law}-{shard}.h5",
    log:
        "logs/meshes/{law}-{shard}.log",
    params:
        tolerance=config["stokes"]["tolerance"],
    script:
        "../scripts/meshes.py"

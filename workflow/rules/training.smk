rule sweep:
    """Cross-validate one configuration of layers for one component."""
    input:
        data="results/dataset/forces.h5",
    output:
        "results/sweep/{component}/{layers}.json",
    log:
        "logs/sweep/{component}/{layers}.log",
    benchmark:
        "benchmarks/sweep/{component}/{layers}.tsv"
    resources:
        gpu=GPUS,
    params:
        library=library("sweep.py"),
        seed=config["seed"],
        test_share=config["dataset"]["test_share"],
        laws=plan.laws(config, "idnn"),
        folds=config["idnn"]["folds"],
        layers=lambda wc: plan.trial_layers(wc.layers),
        radial_input=config["idnn"]["radial_input"],
        device=config["idnn"]["device"],
        training=config["idnn"]["training"],
    script:
        "../scripts/sweep.py"


rule winner:
    """Compare the configurations and choose the one that both components take."""
    input:
        results=expand("results/sweep/{trial}.json", trial=TRIALS),
    output:
        table="results/sweep/summary.csv",
        winner="results/sweep/winner.json",
    log:
        "logs/winner.log",
    localrule: True
    params:
        library=library("winner.py"),
        choice=config["idnn"]["choice"],
    script:
        "../scripts/winner.py"


rule model:
    """Train one force model on both components."""
    input:
        data="results/dataset/forces.h5",
        winner=lambda wc: "results/sweep/winner.json" if wc.model == "idnn" else [],
    output:
        "results/model/{model}.safetensors",
    log:
        "logs/model/{model}.log",
    benchmark:
        "benchmarks/model/{model}.tsv"
    resources:
        gpu=GPUS,
    params:
        library=library("train.py"),
        seed=config["seed"],
        test_share=config["dataset"]["test_share"],
        laws=lambda wc: plan.laws(config, wc.model),
        layers=lambda wc: config["idnn"]["layers_of"].get(wc.model),
        radial_input=config["idnn"]["radial_input"],
        device=config["idnn"]["device"],
        training=lambda wc: plan.training(config, wc.model),
    script:
        "../scripts/train.py"


rule trial:
    """Train a model on some scenes and score it on the test scenes: one point of a comparison."""
    input:
        data="results/dataset/forces.h5",
    output:
        "results/trials/{model}-{layers}-{number}.csv",
    log:
        "logs/trials/{model}-{layers}-{number}.log",
    benchmark:
        "benchmarks/trials/{model}-{layers}-{number}.tsv"
    resources:
        gpu=GPUS,
    params:
        library=library("trial.py"),
        seed=config["seed"],
        test_share=config["dataset"]["test_share"],
        laws=lambda wc: plan.trial_laws(config, wc.model, wc.number),
        layers=lambda wc: plan.trial_layers(wc.layers),
        radial_input=config["idnn"]["radial_input"],
        device=config["idnn"]["device"],
        training=lambda wc: plan.training(config, wc.model),
    script:
        "../scripts/trial.py"


rule learning_curve:
    """Scores against the number of training scenes."""
    input:
        expand("results/trials/{trial}.csv", trial=plan.learning_curve(config)),
    output:
        "results/model/learning_curve.csv",
    log:
        "logs/learning_curve.log",
    localrule: True
    script:
        "../scripts/trials.py"


rule ablation:
    """What each change from the dense network to the anchored IDNN brings."""
    input:
        expand("results/trials/{trial}.csv", trial=plan.ablation(config)),
    output:
        "results/model/ablation.csv",
    log:
        "logs/ablation.log",
    localrule: True
    script:
        "../scripts/trials.py"


rule evaluation:
    """Compare the force models on the scenes that none of them was trained on."""
    input:
        data="results/dataset/forces.h5",
        models=expand("results/model/{model}.safetensors", model=LEARNED_MODELS),
    output:
        table="results/model/evaluation.csv",
        symmetries="results/model/symmetries.csv",
        predictions="results/model/predictions.h5",
    log:
        "logs/evaluation.log",
    localrule: True
    params:
        library=library("evaluation.py"),
        seed=config["seed"],
        test_share=config["dataset"]["test_share"],
    script:
        "../scripts/evaluation.py"

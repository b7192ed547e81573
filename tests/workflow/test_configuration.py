"""The configuration is complete, documented, and refused with one sentence where it is wrong."""

from pathlib import Path

import pytest
import yaml

from dustfall.forces.registry import trained_models
from dustfall.scenes import LAWS
from workflow import configuration
from workflow.configuration import ConfigurationError, configure, keys, load_schema
from workflow.readers import read_by, readers

ROOT = Path(__file__).resolve().parents[2]


def nested(key: str, value) -> dict:
    for part in reversed(key.split(".")):
        value = {part: value}
    return value


def look_up(config: dict, key: str):
    for part in key.split("."):
        config = config[part]
    return config


def test_config_yaml_spells_out_every_default():
    written = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    for key, part in keys(load_schema()).items():
        assert look_up(written, key) == part["default"], key
    assert configure(written) == configure({})


@pytest.mark.parametrize("name", ["smoke", "shorter"])
def test_other_campaigns_are_valid(name):
    configure(yaml.safe_load((ROOT / f"config/{name}.yaml").read_text()))


def test_readme_tabulates_the_schema():
    assert configuration.reference() in (ROOT / "config/README.md").read_text()


def test_every_key_has_a_meaning():
    for key, part in keys(load_schema()).items():
        assert part["description"], key


def test_rules_read_every_key_and_no_other():
    found, known = readers(), keys(load_schema())
    for key in known:
        assert read_by(key, found), f"{key} is read nowhere"
    for path in set().union(*found.values()):
        name = ".".join(path)
        assert any(f"{key}.".startswith(f"{name}." if name else "") for key in known), (
            f"{name} is not in the schema"
        )


@pytest.mark.parametrize(
    ("key", "rules"),
    [
        # In a parameter; through a constant of the rules; through functions of the plan; where a
        # function names a section; in a resource.
        ("studies.together", ["step_size"]),
        ("idnn.layers", ["plan", "winner"]),
        ("idnn.training_of.anchored.epochs", ["model", "trial"]),
        ("dataset.test_share", ["plan", "sweep", "model", "trial", "learning_curve", "evaluation"]),
        (
            "sedimentation.checkpoint_interval",
            ["all_particles", "sedimentation", "study_of_a_step", "study_of_neighbours"],
        ),
    ],
)
def test_a_key_is_read_by_the_rules_that_look_it_up_by_whatever_way(key, rules):
    assert set(read_by(key, readers())) == set(rules)


def test_models_that_have_settings_of_their_own_are_models_that_a_campaign_trains():
    idnn = configure({})["idnn"]
    for section in ("laws_of", "layers_of", "training_of"):
        assert set(idnn[section]) <= set(trained_models()), section


def test_scenes_are_drawn_of_every_radial_law():
    assert list(configure({})["scenes"]["number"]) == list(LAWS)


def test_what_is_left_out_has_its_default():
    config = configure({"sedimentation": {"step": 0.1}})
    assert config["sedimentation"]["step"] == 0.1
    assert config["sedimentation"]["duration"] == configure({})["sedimentation"]["duration"]


def test_order_of_keys_does_not_matter():
    one = configure({"seed": 3, "scenes": {"phi_min": 1e-7, "shard_size": 9}})
    other = configure({"scenes": {"shard_size": 9, "phi_min": 1e-7}, "seed": 3})
    assert repr(one) == repr(other)


def test_the_settings_handed_in_stay_as_they_are():
    settings = {"scenes": {"phi_min": "1e-7"}}
    configure(settings)
    assert settings == {"scenes": {"phi_min": "1e-7"}}


@pytest.mark.parametrize("written", ["1e-7", "1.0e-7", "0.0000001", "1E-7"])
def test_numbers_that_yaml_takes_for_words_are_numbers(written):
    settings = yaml.safe_load(f"scenes: {{phi_min: {written}}}")
    assert configure(settings)["scenes"]["phi_min"] == 1e-7


def test_whole_numbers_may_be_written_as_decimals():
    particles = configure({"sedimentation": {"particles": [1e3, "2e3"]}})["sedimentation"]
    assert [repr(n) for n in particles["particles"]] == ["1000", "2000"]


REFUSED = [
    ("sed", 3, "sed (set to 3) is not a key (did you mean seed?); allowed are seed, scenes,"),
    ("scenes.shard_siz", 3, "scenes.shard_siz (set to 3) is not a key (did you mean shard_size?)"),
    ("scenes.number.cube", 3, "scenes.number.cube (set to 3) is not a key"),
    ("seed", "many", "seed is many, but must be a whole number at least 0."),
    ("seed", -1, "seed is -1, but must be a whole number at least 0."),
    ("seed", 1.5, "seed is 1.5, but must be a whole number at least 0."),
    ("seed", True, "seed is True, but must be a whole number at least 0."),
    ("scenes", None, "scenes is empty, but must be a section with the keys number,"),
    ("scenes", [1], "scenes is [1], but must be a section with the keys number,"),
    ("scenes.phi_max", 0.7, "scenes.phi_max is 0.7, but must be a number at least 1e-12 and at"),
    ("scenes.phi_max", float("nan"), "scenes.phi_max is nan, but must be a number"),
    ("scenes.phi_min", 2e-3, "scenes.phi_min is 0.002, but must be below scenes.phi_max, which"),
    ("scenes.number", {"uniform": 20}, "scenes.number is 20 in all of uniform, but must be at"),
    ("stokes.tolerance", 0, "stokes.tolerance is 0, but must be a number"),
    ("dataset.test_share", 1, "dataset.test_share is 1, but must be a number at least 0.01"),
    ("idnn.folds", 1, "idnn.folds is 1, but must be a whole number at least 2"),
    ("idnn.layers", [], "idnn.layers is [], but must be a list of at least one value"),
    ("idnn.layers", ["10/10"] * 2, "but must be a list of at least one value and no value twice"),
    ("idnn.layers", ["40-40"], 'idnn.layers[0] is "40-40", but must be hidden widths of the two'),
    ("idnn.training.schedule", "step", "is step, but must be one of cosine, constant."),
    ("sedimentation.particles", [1000, 5], "particles[1] is 5, but must be a whole number at"),
    ("sedimentation.volume_fractions", [0.5], "volume_fractions[0] is 0.5, but must be a number"),
    ("sedimentation.galileo.particles", 3, "galileo.particles is 3, but must be a whole number"),
    ("sedimentation.properties.viscosity", 0, "viscosity is 0, but must be a number above 0."),
    ("sedimentation.properties.particle_density", 1.0, "is 1 kg/m³, but must be above"),
    ("sedimentation.model", "idn", "sedimentation.model is idn, but must be one of isolated,"),
    ("sedimentation.statistics_from", 100, "is 100 response times, but must be at most 98"),
    ("sedimentation.duration", 100.01, "duration is 100.01 response times, but must be a multiple"),
    ("sedimentation.save_every", 0.07, "save_every is 0.07 response times, but must be a multiple"),
    ("scenes.number.contact", 3, "scenes.number.contact is 3, but must be 0 or at least 6, so"),
    ("idnn.laws", ["cube"], "idnn.laws[0] is cube, but must be one of uniform, ball, contact."),
    ("figures.fit_frequencies", [2, 1], "fit_frequencies is 2 to 1, but must be the lower to"),
    ("figures.fit_frequencies", [1], "figures.fit_frequencies is [1.0], but must be two numbers"),
]


def test_figures_need_scenes_of_their_law():
    settings = {"scenes": {"number": {"ball": 0}}, "figures": {"radial_law": "ball"}}
    with pytest.raises(ConfigurationError, match=r"figures\.radial_law is ball, but must be a law"):
        configure(settings)


@pytest.mark.parametrize(("key", "value", "sentence"), REFUSED)
def test_bad_settings_are_refused_with_key_value_and_what_is_allowed(key, value, sentence):
    with pytest.raises(ConfigurationError) as refusal:
        configure(nested(key, value))
    words = str(refusal.value)
    assert sentence in words
    assert words.endswith(".")
    assert "\n" not in words


def test_snakemake_ends_at_once_with_the_sentence_alone(project):
    done = project.snakemake("--config", "sedimentation={particles: [4]}", "--", "all")
    assert done.returncode == 1
    words = done.stdout + done.stderr
    assert (
        "Configuration: sedimentation.particles[0] is 4, but must be a whole number at least 6"
        in words
    )
    assert "Traceback" not in words
    assert 'File "' not in words
    assert not (project.folder / "results").exists()

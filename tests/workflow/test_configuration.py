"""The configuration is complete, documented, and refused with one sentence where it is wrong."""

import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from dustfall.analysis import spectra
from dustfall.analysis.correlations import coefficient_of_determination, spearman_by_neighbours
from dustfall.forces.registry import trained_models
from dustfall.scenes import LAWS, MOST_PLACED
from dustfall.streams import Purpose, stream
from tests.forces.scenes import random_neighbours
from workflow import configuration
from workflow.configuration import ConfigurationError, configure, keys, load_schema, read_file
from workflow.readers import read_by, readers

ROOT = Path(__file__).resolve().parents[2]


def nested(key: str, value) -> dict:
    for part in reversed(key.split(".")):
        value = {part: value}
    return value


def merged(settings: dict, key: str, value) -> dict:
    section, name = key.split(".")
    return settings | {section: settings.get(section, {}) | {name: value}}


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
        # function names a section, or two at once; in a resource.
        ("studies.together", ["step_size"]),
        ("idnn.layers", ["plan", "winner"]),
        ("idnn.training_of.anchored.epochs", ["model", "trial"]),
        (
            "dataset.test_share",
            ["plan", "sweep", "model", "trial", "learning_curve", "evaluation", "paper_training"],
        ),
        (
            "sedimentation.checkpoint_interval",
            [
                "all_particles",
                "sedimentation",
                "study_of_a_step",
                "study_of_moving_neighbours",
                "study_of_neighbours",
            ],
        ),
        (
            "sedimentation.long.step",
            ["sedimentation", "study_of_moving_neighbours", "study_of_neighbours"],
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
    ("seed", "many", "seed is many, but must be a whole number at least 0 and at most"),
    ("seed", -1, "seed is -1, but must be a whole number at least 0 and at most"),
    ("seed", 1.5, "seed is 1.5, but must be a whole number at least 0 and at most"),
    ("seed", True, "seed is True, but must be a whole number at least 0 and at most"),
    ("scenes", None, "scenes is empty, but must be a section with the keys number,"),
    ("scenes", [1], "scenes is [1], but must be a section with the keys number,"),
    ("scenes.phi_max", 0.7, "scenes.phi_max is 0.7, but must be a number at least 1e-12 and at"),
    ("scenes.phi_max", float("nan"), "scenes.phi_max is nan, but must be a number"),
    ("scenes.phi_min", 2e-3, "scenes.phi_min is 0.002, but must be below scenes.phi_max, which"),
    ("scenes.neighbours", 2, "scenes.neighbours is 2, but must be a whole number at least 3 and"),
    ("scenes", {"neighbours": 3, "phi_max": 0.05}, "phi_max is 0.05, but must be at most 0.0469"),
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
    ("sedimentation.properties.viscosity", 0, "viscosity is 0, but must be a number above 0 and"),
    ("sedimentation.properties.particle_density", 1.0, "is 1 kg/m³, but must be above"),
    ("sedimentation.model", "idn", "sedimentation.model is idn, but must be one of reflections,"),
    ("sedimentation.model", "isolated", "is isolated, but must be one of reflections, rotne"),
    ("sedimentation.statistics_from", 100, "is 100 response times, but must be at most 88"),
    ("sedimentation.duration", 100.01, "duration is 100.01 response times, but must be a multiple"),
    ("sedimentation.save_every", 0.07, "save_every is 0.07 response times, but must be a multiple"),
    (
        "sedimentation.step",
        1e-307,
        "is 100 response times, but must be at most 1,000,000,000 times sedimentation.step, which",
    ),
    ("sedimentation.long.step", 1e-9, "is 25 spreading times, but must be at most 1,000,000,000"),
    ("studies.steps", [0.1, 1e-307], "must be at most 1,000,000,000 times one of studies.steps"),
    (
        "sedimentation.save_every",
        0.3,
        "must be a multiple of sedimentation.save_every, which",
    ),
    ("scenes.number.contact", 3, "scenes.number.contact is 3, but must be 0 or at least 6, so"),
    ("idnn.laws", ["cube"], "idnn.laws[0] is cube, but must be one of uniform, ball, contact."),
    ("figures.fit_frequencies", [2, 1], "fit_frequencies is 2 to 1, but must be the lower to"),
    (
        "figures.fit_frequencies",
        [2, 3],
        "fit_frequencies is 2 to 3, but must hold at least 3 of the",
    ),
    ("figures.fit_frequencies", [0.2, 0.25], "but must hold at least 3 of the frequencies that"),
    ("sedimentation.save_every", 200, "save_every is 200 response times, but must be at most 8.33"),
    (
        "sedimentation.duration",
        1,
        "sedimentation.duration is 1 response times, but must be at least",
    ),
    ("studies.duration", 1, "studies.duration is 1 response times, but must be at least 20 of"),
    (
        "sedimentation.properties.diameter",
        25,
        "diameter is 25, but must be a number above 0 and at",
    ),
    (
        "sedimentation.properties.diameter",
        1e-3,
        "give a Galileo number of 5.01e+03, but must, in SI",
    ),
    (
        "sedimentation.galileo.multiples",
        [1, 20],
        "of 1.56 at 20 of sedimentation.galileo.multiples",
    ),
    ("sedimentation.checkpoint_interval", 0.5, "is 0.5, but must be a whole number at least 1 and"),
    ("sedimentation.start_file", "start.nc", "one file for 18 clouds of different numbers of"),
    ("idnn.layers", ["99999999999/10"], 'idnn.layers[0] is "99999999999/10", but must be hidden'),
    ("scenes.number", {"ball": 0}, "idnn.laws_of.anchored names ball, but must name laws that"),
    (
        "seed",
        2**32,
        "seed is 4294967296, but must be a whole number at least 0 and at most 4294967295",
    ),
    ("seed", 10**400, "seed is a number of very many digits, but must be a whole number"),
    ("seed", 1e300, "seed is 1e+300, but must be a whole number at least 0 and at most"),
    ("figures.fit_frequencies", [1], "figures.fit_frequencies is [1.0], but must be two numbers"),
]


def own_data(folder: Path, scenes: int, neighbours: int = 5) -> dict:
    """Settings of a data set of one's own, and its file as far as the configuration looks at it."""
    names = [f"{axis}{j}" for j in range(1, neighbours + 1) for axis in "xyz"]
    names += ["force_x", "force_y", "force_z"]
    rows = [",".join(names), *[",".join("0" for _ in names)] * scenes]
    (folder / "own.csv").write_text("\n".join(rows))
    return {"dataset": {"file": str(folder / "own.csv")}}


CLOUDS = [
    ("sedimentation.particles", [1000, 15], "goes down to 15"),
    ("sedimentation.galileo.particles", 20, "is 20"),
    ("sedimentation.long.particles", [15], "is 15"),
    ("studies.particles", 15, "is 15"),
]
"""Clouds of nearest neighbours, too small for twenty."""


@pytest.mark.parametrize(("key", "value", "shown"), CLOUDS)
def test_a_cloud_has_more_particles_than_neighbours(tmp_path, key, value, shown):
    for settings, of in (
        ({"scenes": {"neighbours": 20}}, "scenes.neighbours, which is 20."),
        (own_data(tmp_path, 1000, neighbours=20), "own.csv, which are 20."),
    ):
        configure(settings)
        with pytest.raises(ConfigurationError) as refusal:
            configure(settings | nested(key, value))
        words = str(refusal.value)
        assert words.startswith(f"{key} {shown}, but must stay above ")
        assert words.endswith(of)


def test_a_cloud_in_which_all_feel_each_other_may_have_few_particles():
    configure(
        {"scenes": {"neighbours": 20}} | nested("sedimentation.all_particles.particles", [15])
    )


def test_scenes_have_as_many_neighbours_as_find_room():
    assert keys(load_schema())["scenes.neighbours"]["maximum"] == MOST_PLACED


def test_a_seed_is_one_that_random_streams_take():
    largest = keys(load_schema())["seed"]["maximum"]
    stream(Purpose.SCENE, configure({"seed": largest})["seed"])
    with pytest.raises(ValueError, match="seed and items"):
        stream(Purpose.SCENE, largest + 1)


def test_figures_need_scenes_of_their_law():
    settings = {"scenes": {"number": {"ball": 0}}, "figures": {"radial_law": "ball"}}
    with pytest.raises(ConfigurationError, match=r"figures\.radial_law is ball, but must be a law"):
        configure(settings)


def test_every_law_leaves_scenes_for_the_test_and_that_of_the_figures_two(tmp_path):
    for settings, sentence in (
        (own_data(tmp_path, 40) | {"idnn": {"folds": 2}}, "own.csv, which has 40 scenes, but must"),
        (
            {"scenes": {"number": {"uniform": 140}}, "figures": {"radial_law": "uniform"}},
            "scenes.number.uniform is 140, but must be at least 150, so that",
        ),
        ({"scenes": {"number": {"ball": 50}}}, "ball is 50, but must be 0 or at least 51, so that"),
    ):
        with pytest.raises(ConfigurationError) as refusal:
            configure(merged(settings, "dataset.test_share", 0.01))
        assert sentence in str(refusal.value)
        configure(merged(settings, "dataset.test_share", 0.05))


def test_two_scenes_of_the_test_have_a_variance_and_three_of_a_law_have_ranks():
    draws = np.random.default_rng(1)
    for number, needed, of in (
        (
            configuration.TESTED_SCENES,
            "no variance",
            lambda m: coefficient_of_determination(*draws.normal(size=(2, m))),
        ),
        (
            configuration.RANKED_SCENES,
            "rank correlation",
            lambda m: spearman_by_neighbours(random_neighbours(m), draws.normal(size=(m, 3))),
        ),
    ):
        of(number)
        with pytest.raises(ValueError, match=needed):
            of(number - 1)


def test_no_model_trains_on_fewer_scenes_than_are_allowed():
    from dustfall.training import train_model  # here alone, as it takes seconds

    few = configuration.TRAINED_SCENES
    neighbours, force = random_neighbours(few - 1), np.ones((few - 1, 3))
    with pytest.raises(ValueError, match=f"training needs {few} or more"):
        train_model("dense", neighbours, force, "2")


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        # Two scenes at a share that gives each side one.
        (
            {"scenes": {"number": {"contact": 2}}, "dataset": {"test_share": 0.5}},
            "scenes.number.contact is 2, but must be 0 or at least 3, so that ranks of 3 can be",
        ),
        # Six scenes and a share of a tenth leave five.
        (
            {
                "scenes": {"number": {"contact": 6}},
                "idnn": {"laws_of": {"anchored": ["contact"]}},
            },
            "idnn.laws_of.anchored is contact, of which scenes.number and dataset.test_share, 0.1, "
            "leave 5 scenes to train on, but must be laws that leave at least 10.",
        ),
        # Ten scenes a fold, and more than half of those of each law are for the test.
        (
            {
                "scenes": {"number": {"uniform": 7, "ball": 7, "contact": 7}},
                "dataset": {"test_share": 0.5},
                "idnn": {"laws": ["uniform", "ball", "contact"], "folds": 2},
            },
            "idnn.laws is uniform, ball, contact, of which scenes.number and dataset.test_share, "
            "0.5, leave 9 scenes",
        ),
    ],
)
def test_scenes_are_too_few_for_what_is_made_of_them(settings, sentence):
    with pytest.raises(ConfigurationError) as refusal:
        configure(settings)
    assert sentence in str(refusal.value)


FILES = {
    "seed: 1\nscenes: {}\nseed: 2\n": "sets seed twice, in line 1 and in line 3.",
    "scenes:\n  number:\n    ball: 1\n    ball: 2\n": "sets ball twice, in line 3 and in line 4.",
    "seed: 1\nscenes: {number: [\n": ", line 3 is no YAML: ",
    "seed: 1\n\tscenes: 2\n": ", line 2 is no YAML: ",
    "- 1\n": "must hold sections and keys, like: seed: 1.",
    "a: &b [1]\nc: *b\n": ", line 1: an alias repeats this part, but is not allowed.",
    "a: &b [*b]\n": ", line 1: an alias repeats this part, but is not allowed.",
    "__use_yte__: true\nseed: ?1 + 1\n": ", line 1: __use_yte__ has Snakemake run what the file",
    "a: !!python/object/apply:os.system [exit]\n": ", line 1 is no YAML: could not determine a",
    "[" * 5000: "cannot be read as YAML: ",
    "seed: " + "9" * 5000: "cannot be read as YAML: ",
    "\udcff": "is no text in UTF-8: ",
    "#" * 2_000_000: "has 2000000 bytes, allowed are 1000000.",
}


@pytest.mark.parametrize("content", FILES, ids=range(len(FILES)))
def test_files_that_are_no_settings_are_refused_with_file_and_line(tmp_path, content):
    path = tmp_path / "mine.yaml"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(ConfigurationError) as refusal:
        read_file(path)
    assert str(refusal.value).startswith(f"{path}")
    assert FILES[content] in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_missing_file_of_settings_is_told_in_one_sentence(tmp_path):
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(ConfigurationError, match="is no file"):
            read_file(path)


def test_files_of_settings_are_read_as_yaml_reads_them():
    for path in (ROOT / "config").glob("*.yaml"):
        assert read_file(path) == yaml.safe_load(path.read_text())


def test_frequencies_are_those_that_the_spectra_resolve():
    for name in ("HIGHEST_FITTED", "SHORTEST_SEGMENT", "BINS_PER_DECADE"):
        assert getattr(configuration, name) == getattr(spectra, name)
    # The fewest frames that are allowed give a slope by both methods.
    values = np.random.default_rng(1).normal(size=configuration.STEADY_FRAMES + 1)
    for method in ("periodogram", "welch"):
        frequency, density = spectra.power_spectral_density(values, 1.0, method)
        limits = (0.0, spectra.HIGHEST_FITTED)
        assert spectra.spectral_slope(frequency[1:], density[1:], limits=limits).slope


@pytest.mark.parametrize(("last", "allowed"), [(125, False), (127, True)])
def test_lines_of_a_spectrum_count_by_the_bins_that_they_are_averaged_in(last, allowed):
    # Steps of 0.1 in segments of 1250 resolve multiples of 0.008, and so do frames.
    times = {"step": 0.1, "save_every": 0.1, "duration": 1000, "statistics_from": 0}
    settings = {"sedimentation": times | {"long": {"particles": []}}}
    bins = spectra.averaged_in_bins(np.arange(1, last + 1), np.ones(last))
    assert (sum(bins["kappa"] >= 100) >= configuration.FITTED_VALUES) == allowed
    limits = nested("figures.fit_frequencies", [0.8, 0.008 * (last + 0.5)])
    if allowed:
        configure(settings | limits)
    else:
        with pytest.raises(ConfigurationError, match="at least 3 of the frequencies"):
            configure(settings | limits)


def test_a_spectrum_of_millions_of_lines_is_checked_at_once():
    times = {"step": 2e-7, "statistics_from": 0}
    began = time.process_time()
    configure({"sedimentation": times} | nested("figures.fit_frequencies", [0, 1e12]))
    assert time.process_time() - began < 2


def test_a_start_that_is_a_folder_is_refused(tmp_path):
    (tmp_path / "n1000_phi1e-08_ga1").mkdir()
    with pytest.raises(ConfigurationError, match=r"start_file names .*_ga1, a folder, but must"):
        configure(nested("sedimentation.start_file", f"{tmp_path}/{{case}}"))


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

"""The numbers of docs/validation.md: small tables, reduced from what a campaign left.

`collect` writes them, with the configuration and the provenance, into docs/validation/, and
`page` fills in the template with what is there. A table whose source was not run is left out, and
the page says so.
"""

import datetime
import json
import os
import platform
import shutil
import subprocess
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy
import yaml

from dustfall.analysis.references import (
    MATCHED_GAMMA,
    PAPER_SCORES,
    PAPER_SETTLING,
)
from dustfall.benchmarks.moving_estimates import coverage
from dustfall.benchmarks.solver import MULTIPOLE
from dustfall.figures.style import CLOSURES, model_title
from dustfall.scenes import LAWS
from dustfall.sedimentation.closures.names import ALL_PARTICLES, BACK_FLOW
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.state import box_length
from dustfall.stokes import Status, fixed_spheres
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres
from dustfall.suspension.batchelor import BATCHELOR_COEFFICIENT
from dustfall.units import COMPONENTS, RADIUS, SPHERE_VOLUME, STOKES_DRAG
from workflow.library import ROOT
from workflow.pages import read_tables, render, wide

CONFIGURATION = "results/config.yaml"

PICTURES = {
    **{
        f"{name}.png": f"results/figures/{name}.png"
        for name in (
            "accuracy_vs_cost",
            "audit",
            "closures",
            "cloud_spectra",
            "error_by_distance",
            "force_pdf",
            "frozen_cloud",
            "inverse_beta",
            "learning_curve",
            "mesh_study",
            "neighbour_numbers",
            "predicted_vs_target",
            "scene_meshes",
            "sketches",
            "trajectories",
            "trajectories_3d",
            "trajectories_all_particles",
            "voronoi_variance",
        )
    },
    "settling_cloud.gif": "results/figures/settling_cloud.gif",
    "moving.png": "results/benchmarks/moving.png",
    "solver.png": "results/benchmarks/solver.png",
}
"""Pictures that README and docs show: name in docs/pictures, and the file that it is a copy of."""

PAIR_DISTANCES = (2.01, 2.1, 2.5, 3.0, 5.0, 10.0, 20.0)
"""Centre distances [radii] of two spheres, from nearly touching to nearly alone."""

PAIR_EXPONENTS = (4, 6, 8)
"""Decades of the tolerances at which two spheres are solved."""

COMPARED_SETS = 2
"""Sets of scenes in which methods are compared: the last ones, the densest decade and contact."""

CLOSURE_TIMES = (10, 50, 100)
"""Times [tau] at which closures are compared."""

CROWDED_CELL = 0.5
"""Volume of a Voronoi cell over the mean below which its particle is crowded."""

DATA_ROWS = {
    ("share_15_percent_below_stokes", "streamwise"): "share at least 15 % below Stokes",
    ("share_34_percent_below_stokes", "streamwise"): "share at least 34 % below Stokes",
    ("variance", "spanwise"): "spanwise variance",
    ("variance", "vertical"): "vertical variance",
    ("laplace_ks", "spanwise"): "distance of the spanwise force from the fitted Laplace law",
    ("laplace_ks_level", "spanwise"): "distance that a sample of that law exceeds once in twenty",
    ("normal_ks", "spanwise"): "distance from the fitted normal law",
}
"""Rows of `analysis.distributions.force_summary` that the page shows."""

PAPER_LAW = "uniform"
"""Radial law whose scores stand for the paper's."""


class Provenance(NamedTuple):
    """Where numbers come from: code, day, machine and configuration."""

    commit: str
    date: str
    processor: str
    cores: int
    versions: dict[str, str]
    configuration: str


def provenance(configuration: str) -> Provenance:
    """Provenance of what is measured here and now, under the named configuration files."""
    return Provenance(
        _commit(),
        datetime.date.today().isoformat(),
        _processor(),
        os.cpu_count() or 1,
        {name: version(name) for name in ("numpy", "scipy", "numba", "torch")},
        configuration,
    )


def _commit() -> str:
    """Short name of the commit, with a word on changes of what computes; empty outside of git."""
    git = ["git", "-C", str(ROOT)]
    try:
        commit = subprocess.check_output([*git, "rev-parse", "--short", "HEAD"], text=True).strip()
        # Page and pictures change with each rendering and compute nothing.
        code = ["Snakefile", "config", "dustfall", "workflow"]
        changed = subprocess.check_output([*git, "status", "--porcelain", "--", *code], text=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{commit} with changes" if changed else commit


def _processor() -> str:
    """Model name of the processor, as far as the system tells it."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def pairs() -> pd.DataFrame:
    """Largest error of the force on two spheres, along and across their line, over 24.

    Columns distance [radii], and along_k and across_k at the tolerance 1e-k of `PAIR_EXPONENTS`.
    """
    rows = []
    for distance in PAIR_DISTANCES:
        row = {"distance": distance}
        for axis, flow in {"along": (0.0, 0.0, 1.0), "across": (0.0, 1.0, 0.0)}.items():
            centres = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, distance * RADIUS]])
            exact = forces_on_two_spheres(centres, flow)
            for exponent in PAIR_EXPONENTS:
                found = fixed_spheres(centres, flow, 10.0**-exponent).force
                row[f"{axis}_{exponent}"] = np.abs(found - exact).max() / STOKES_DRAG
        rows.append(row)
    return pd.DataFrame(rows)


def random_scenes(solver: pd.DataFrame) -> pd.DataFrame:
    """This solver's error and coverage over all random scenes, one row a tolerance."""
    own = solver[solver["method"] == MULTIPOLE]
    return own.groupby("setting", sort=False, as_index=False).agg(
        scenes=("scenes", "sum"),
        fastest=("milliseconds", "min"),
        slowest=("milliseconds", "max"),
        error_median=("error_median", "max"),
        error_max=("error_max", "max"),
        covered=("covered", "min"),
        estimate_over_error=("estimate_over_error", "max"),
    )


def methods(solver: pd.DataFrame) -> pd.DataFrame:
    """Every method in the two last sets, near contact the last: one row a method and setting."""
    sets = list(dict.fromkeys(solver["set"]))[-COMPARED_SETS:]
    compared = solver[solver["set"].isin(sets)]
    keys = ["method", "setting"]
    compared = compared.assign(setting=compared["setting"].fillna(""))
    found = compared[keys].drop_duplicates()
    for short, name in zip(("dense", "contact"), sets, strict=True):
        own = compared[compared["set"] == name]
        columns = {"scenes": f"{short}_scenes", "milliseconds": f"{short}_milliseconds"}
        columns |= {"error_median": f"{short}_median", "error_max": f"{short}_error"}
        found = found.merge(own[[*keys, *columns]].rename(columns=columns), on=keys, how="left")
    return found


def strain(stress: pd.DataFrame) -> pd.DataFrame:
    """What strains the solver: one row a tolerance, over clusters and gaps, the finest last.

    apart, moved, turned and alike are the largest errors of `benchmarks.stress.distances` and of
    each change of `benchmarks.stress.invariances`.
    """
    names = {
        "pair": "apart",
        "moved [d_p]": "moved",
        "turned": "turned",
        "distances alike": "alike",
    }
    rows = []
    for tolerance, group in stress[stress["test"] != "crowd"].groupby("tolerance"):
        gaps = group[group["test"] == "gap"]
        converged = gaps[gaps["status"] == str(Status.CONVERGED)]
        rest = group[group["test"].isin(["distance", "invariance"])]
        rows.append(
            {
                "tolerance": tolerance,
                "clusters": len(gaps),
                "converged": len(converged),
                "smallest_gap": converged["value"].min(),
                "slowest": 1e3 * converged["seconds"].max(),
                "error_max": converged["error"].max(),
                "covered": (gaps["estimate"] >= gaps["error"]).mean(),
            }
            | rest.groupby("case")["error"].max().rename(names).to_dict()
        )
    return pd.DataFrame(rows).sort_values("tolerance", ascending=False, ignore_index=True)


def crowds(stress: pd.DataFrame) -> pd.DataFrame:
    """What could fool the error estimate: one row a family of scenes, over all tolerances.

    over_tolerance is the largest error of the converged in tolerances, over_estimate that of all
    over its estimate; difference, that from fundamental solutions, and peer_estimate, the largest
    of what these estimate of their own error.
    """
    found = stress[stress["test"] == "crowd"]
    converged = found["status"] == str(Status.CONVERGED)
    found = found.assign(
        converged=converged,
        over_tolerance=(found["error"] / found["tolerance"]).where(converged),
        over_estimate=found["error"] / found["estimate"],
    )
    return found.groupby("case", sort=False, as_index=False).agg(
        scenes=("scene", "nunique"),
        smallest_gap=("value", "min"),
        solves=("scene", "size"),
        converged=("converged", "sum"),
        over_tolerance=("over_tolerance", "max"),
        over_estimate=("over_estimate", "max"),
        compared=("difference", "count"),
        difference=("difference", "max"),
        peer_estimate=("peer_estimate", "max"),
    )


def audit(table: pd.DataFrame) -> pd.DataFrame:
    """Scenes solved by another method too: one row a law and method, all over 24.

    excess is the difference of the forces over the sum of both estimates.
    """
    grouped = table.groupby(["radial_law", "method"], sort=False, as_index=False)
    return grouped.agg(
        scenes=("scene", "size"),
        smallest_gap=("minimum_gap", "min"),
        difference=("difference", "median"),
        largest=("difference", "max"),
        estimate=("estimate", "median"),
        excess=("excess", "max"),
    )


def meshes(study: pd.DataFrame, convergence: pd.DataFrame) -> pd.DataFrame:
    """Finest mesh of each discretisation: one row a scheme, with its convergence if it is flat.

    On projected elements a lone sphere shows quadrature and rounding, which have no order.
    """
    finest = study.loc[study.groupby("scheme", sort=False)["elements"].idxmax()]
    finest = finest.assign(error=(finest["force"] / finest["limit"] - 1).abs())
    last = convergence.sort_values("nodes").drop_duplicates("scheme", keep="last")
    last = last[last["scheme"].str.contains("flat")]
    return finest.merge(last[["scheme", "order", "extrapolated", "gci"]], on="scheme", how="left")


def forces(summary: dict) -> pd.DataFrame:
    """Shares, variances and distances of the forces by law, the paper's beside them."""
    rows = []
    laws = {law: pd.DataFrame(own["forces"]) for law, own in summary.items()}
    # The first row of a quantity is that of all decades.
    whole = {
        law: own.drop_duplicates(["quantity", "component"]).set_index(["quantity", "component"])
        for law, own in laws.items()
    }
    for key, words in DATA_ROWS.items():
        row: dict[str, str | float] = {"quantity": words}
        for law in LAWS:
            has = law in whole and key in whole[law].index
            row[law] = whole[law].loc[key, "value"] if has else np.nan
            if has:
                row["paper"] = whole[law].loc[key, "paper"]
        rows.append(row)
    return pd.DataFrame(rows)


def scenes(summary: pd.DataFrame) -> pd.DataFrame:
    """The data set: one row a law."""
    table = summary.groupby("radial_law", as_index=False).agg(
        scenes=("scenes", "sum"),
        unconverged=("unconverged", "sum"),
        error_estimate_max=("error_estimate_max", "max"),
        iterations_max=("iterations_max", "max"),
        gap_min=("gap_min", "min"),
    )
    return _in_order(table, "radial_law", LAWS)


def scores(evaluation: pd.DataFrame, violations: pd.DataFrame) -> pd.DataFrame:
    """Scores on all test scenes of a law: one row a law and model, the better ones below.

    asymmetry is the largest RMS violation of a symmetry, over the scenes of all laws.
    """
    table = _by_component(evaluation, ["radial_law", "model"], ["r2", "rms_error", "largest_error"])
    columns = {f"r2_{component}": f"paper_{component}" for component in COMPONENTS}
    paper = PAPER_SCORES.rename(columns=columns).assign(radial_law=PAPER_LAW)
    table = table.merge(paper, on=["radial_law", "model"], how="left")
    asymmetry = violations.groupby("model")["rms"].max()
    table = table.assign(
        title=table["model"].map(model_title), asymmetry=table["model"].map(asymmetry)
    ).sort_values("r2_streamwise")
    return _in_order(table, "radial_law", LAWS).drop(columns="model")


def learning_curve(trials: pd.DataFrame) -> pd.DataFrame:
    """Scores on the paper's law against the number of scenes: one row a model and number."""
    own = trials[trials["radial_law"] == PAPER_LAW]
    return _by_component(own, ["model", "training_scenes"], ["r2"])


def ablation(trials: pd.DataFrame) -> pd.DataFrame:
    """Scores on the paper's law: one row a model, in the order of the changes."""
    own = trials[trials["radial_law"] == PAPER_LAW]
    return _by_component(own, ["title", "layers"], ["r2", "rms_error", "parameters"])


def sweep(summary: pd.DataFrame) -> pd.DataFrame:
    """Cross-validated scores: one row a configuration of layers, the smallest first."""
    columns = ["r2_mean", "r2_deviation", "parameters", "multiplications"]
    table = _by_component(summary, ["layers", "winner"], columns)
    table = table.assign(chosen=table.pop("winner").map({True: "chosen", False: None}))
    return table.sort_values("parameters_streamwise", ignore_index=True)


def cost(accuracy: pd.DataFrame) -> pd.DataFrame:
    """Time of a prediction: one row a model, the cheapest first."""
    table = accuracy.drop_duplicates("model")[["model", "microseconds"]]
    table = table.assign(title=table["model"].map(model_title))
    return table.sort_values("microseconds", ignore_index=True)


def settling(steady: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """Settling velocity of the campaign's model: one row a phi and n, the paper's beside it."""
    own = _cases(steady, configuration["sedimentation"]["model"])
    velocity = own[own["quantity"] == "settling_velocity_mean"]
    start = own[own["quantity"] == "inverse_beta_mean"]
    table = _steady_columns(velocity).merge(
        start[["n", "volume_fraction", "first"]].rename(columns={"first": "start"}),
        on=["n", "volume_fraction"],
    )
    paper = PAPER_SETTLING[PAPER_SETTLING["quantity"] == "inverse_beta"]
    return _with_paper(table, paper).sort_values(["volume_fraction", "n"], ignore_index=True)


def apparent(steady: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """The same with the paper's modified viscosity over eta, beta, and its Ga* = Ga / beta^2."""
    table = settling(steady, configuration)
    velocity = table["value"].fillna(table["end"])
    return table.assign(viscosity=1 / velocity, apparent_galileo=table["galileo"] * velocity**2)


def neighbour_numbers(table: pd.DataFrame) -> pd.DataFrame:
    """Settling velocity by number of neighbours; a point of the paper stands bare, a bound not."""
    return table.assign(relation=table["relation"].replace("=", None))


def galileo(steady: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """Settling velocity where the Galileo number was changed: one row a number."""
    settle = configuration["sedimentation"]
    own = steady[
        (steady["model"] == settle["model"])
        & (steady["quantity"] == "settling_velocity_mean")
        & (steady["n"] == settle["galileo"]["particles"])
        & (steady["volume_fraction"] == settle["galileo"]["volume_fraction"])
    ]
    return _steady_columns(own.sort_values("galileo"))


def models(steady: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """Settling velocity of every model in the smallest clouds: one row a phi and model."""
    settle = configuration["sedimentation"]
    own = steady[
        (steady["n"] == min(settle["long"]["particles"] or settle["particles"]))
        & (steady["quantity"] == "settling_velocity_mean")
    ]
    own = own.sort_values("galileo").drop_duplicates(["model", "volume_fraction"])
    table = _steady_columns(own)
    table = table.assign(title=table["model"].map(model_title))
    return table.sort_values(["volume_fraction", "model"], ignore_index=True)


def all_particles(steady: pd.DataFrame) -> pd.DataFrame:
    """Clouds of which all particles feel each other: one row a phi and number of particles."""
    own = steady[steady["model"] == ALL_PARTICLES]
    if own.empty:
        return own
    velocity = own[own["quantity"] == "settling_velocity_mean"]
    table = _steady_columns(velocity)
    for quantity in ("settling_velocity_variance", "box_reynolds", "memory_from"):
        last = own[own["quantity"] == quantity].set_index(["n", "volume_fraction"])["end"]
        table = table.join(last.rename(quantity), on=["n", "volume_fraction"])
    length = [
        box_length(n, phi) for n, phi in zip(table["n"], table["volume_fraction"], strict=True)
    ]
    return table.assign(box_length=length).sort_values(["volume_fraction", "n"], ignore_index=True)


def closures(figure: pd.DataFrame) -> pd.DataFrame:
    """Closures beside each other at the densest phi: one row a closure and number of particles.

    velocity_t and variance_t at t = 10, 50 and 100 tau, or at the last step before; contact, the
    pair distribution in the innermost shell; crowded, the share of Voronoi cells below
    `CROWDED_CELL`, and random_crowded, that of random points.
    """
    rows = []
    for (model, n), own in figure.groupby(["model", "n"]):
        panel = dict(list(own.groupby("panel")))
        row = {"model": model, "title": model_title(model), "n": n, "box": own["box"].iloc[0]}
        for name, column in {"velocity": "mean", "variance": "variance"}.items():
            curve = panel[column].sort_values("x")
            row |= {f"{name}_{t}": np.interp(t, curve["x"], curve["y"]) for t in CLOSURE_TIMES}
        row["contact"] = panel["pairs"].sort_values("x")["y"].iloc[0]
        cells = panel["voronoi"].sort_values("x")
        width = cells["x"].diff().iloc[1]
        row["crowded"] = width * cells.loc[cells["x"] < CROWDED_CELL, "y"].sum()
        shape, scale = MATCHED_GAMMA
        row["random_crowded"] = scipy.stats.gamma.cdf(CROWDED_CELL, shape, scale=scale)
        rows.append(row)
    return pd.DataFrame(rows).sort_values(["model", "n"], ignore_index=True)


def settling_cost(steps: pd.DataFrame) -> pd.DataFrame:
    """What steps cost, one row a number of particles: columns <quantity>_<closure>_<threads>."""
    case = steps["closure"] + "_" + steps["threads"].astype(str)
    columns = ["particles", "seconds", "products", "exponent"]
    memory = steps.groupby("particles", as_index=False)["memory"].max()
    return wide(steps[columns].assign(case=case), "particles", "case").merge(memory)


def back_flow(steady: pd.DataFrame) -> pd.DataFrame:
    """Nearest neighbours without and with back-flow: one row a phi, of the clouds that ran both."""
    velocity = steady[steady["quantity"] == "settling_velocity_mean"]
    own = velocity[velocity["model"] == BACK_FLOW]
    if own.empty:
        return own
    model = velocity.loc[~velocity["model"].isin(CLOSURES), "model"].value_counts().index[0]
    table = _steady_columns(own).merge(
        _steady_columns(velocity[velocity["model"] == model]),
        on=["n", "volume_fraction", "galileo"],
        suffixes=("", "_five"),
    )
    random = 1 + BATCHELOR_COEFFICIENT * table["volume_fraction"]
    return table.assign(random=random).sort_values("volume_fraction", ignore_index=True)


def oseen(configuration: dict) -> pd.DataFrame:
    """Volume fraction at which the mean spacing is the Oseen length nu / v_s, and Galileo number.

    Beyond that length from a sphere inertia rules the flow, and its Stokeslet does not hold.
    """
    galileo = Properties(**configuration["sedimentation"]["properties"]).galileo
    return pd.DataFrame([{"galileo": galileo, "volume_fraction": SPHERE_VOLUME * galileo**3}])


def frozen_cloud(figure: pd.DataFrame) -> pd.DataFrame:
    """Five neighbours and all particles in frozen random clouds: one row a phi."""
    names = {
        ("settling", "five neighbours"): "velocity_five",
        ("settling", "all particles"): "velocity_all",
        ("drag", "five neighbours"): "drag_five",
        ("drag", "all particles"): "drag_all",
        ("correlation", "five neighbours, all particles"): "correlation",
    }
    table = pd.DataFrame({"volume_fraction": sorted(figure["volume_fraction"].dropna().unique())})
    for (panel, source), name in names.items():
        own = figure[(figure["panel"] == panel) & (figure["source"] == source)]
        values = {"volume_fraction": own["volume_fraction"], name: own["y"]}
        values[f"{name}_half"] = (own["high"] - own["low"]) / 2
        table = table.merge(pd.DataFrame(values), on="volume_fraction", how="left")
    return table.assign(batchelor=1 + BATCHELOR_COEFFICIENT * table["volume_fraction"])


def neighbours(figure: pd.DataFrame) -> pd.DataFrame:
    """Mean drag in the densest frozen clouds: one row a number of neighbours."""
    own = figure[figure["panel"] == "neighbours"]
    own = own[own["volume_fraction"] == own["volume_fraction"].max()]
    half = (own["high"] - own["low"]) / 2
    table = own.rename(columns={"x": "neighbours", "y": "drag"}).assign(half=half)
    return table[["volume_fraction", "neighbours", "drag", "half"]]


def fluctuations(
    spectra: pd.DataFrame, tracked: pd.DataFrame, ergodicity: pd.DataFrame
) -> pd.DataFrame:
    """Slopes of the spectra and spread of time averages of the largest clouds: one row a phi.

    slope_<method> and half_<method> are those of all particles over the window in which the cloud
    is steady; steepest and flattest those of the tracked particles over the paper's.
    """
    slopes = spectra[spectra["panel"] == "fit"].drop_duplicates(["method", "volume_fraction"])
    half = (slopes["slope_high"] - slopes["slope_low"]) / 2
    columns = ["volume_fraction", "method", "slope", "half"]
    slopes = wide(slopes.assign(half=half)[columns], "volume_fraction", "method")
    early = tracked[tracked["panel"] == "fit"].groupby("volume_fraction", as_index=False)
    early = early.agg(steepest=("slope", "min"), flattest=("slope", "max"))
    longest = ergodicity.sort_values("window").drop_duplicates("volume_fraction", keep="last")
    longest = longest[["volume_fraction", "n", "window", "spread"]]
    return slopes.merge(early, how="left").merge(longest, on="volume_fraction")


def voronoi(figure: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """Variance of the Voronoi cells of the largest clouds: one row a phi, the paper's beside it.

    All over k theta^2 = 0.2, as the paper gives it.
    """
    own = figure[(figure["source"] == "simulation") & (figure["n"] == _largest(configuration))]
    largest = own.sort_values("galileo").groupby("volume_fraction", as_index=False).first()
    table = largest[["volume_fraction", "n", "status", "variance"]]
    table = table.assign(half=(largest["high"] - largest["low"]) / 2)
    random = figure[figure["source"] == "random spheres"]
    random = random.assign(random_half=(random["high"] - random["low"]) / 2)
    random = random.rename(columns={"variance": "random"})
    points = figure.loc[figure["source"] == "random points", "variance"]
    table = table.merge(random[["volume_fraction", "random", "random_half"]], on="volume_fraction")
    paper = PAPER_SETTLING[PAPER_SETTLING["quantity"] == "voronoi_variance"]
    return _with_paper(table.assign(points=points.iloc[0]), paper)


def changes(table: pd.DataFrame, configuration: dict) -> pd.DataFrame:
    """How often neighbours change in the largest clouds: one row a phi."""
    own = _cases(table, configuration["sedimentation"]["model"])
    own = own.assign(half=(own["high"] - own["low"]) / 2)
    own = own[own["n"] == _largest(configuration)]
    return own.sort_values("volume_fraction", ignore_index=True)


def run_times(folder: Path) -> pd.DataFrame:
    """What the jobs under a folder of Snakemake's benchmarks took: one row a stage.

    Columns stage, jobs, core_seconds (CPU time), longest (wall seconds of one job) and memory
    (largest resident set) [MiB].
    """
    jobs = []
    for path in sorted(folder.rglob("*.tsv")):
        times = pd.read_csv(path, sep="\t", na_values="-")
        jobs.append(times.assign(stage=path.relative_to(folder).parts[0].removesuffix(".tsv")))
    table = (
        pd.concat(jobs)
        .groupby("stage", as_index=False)
        .agg(
            jobs=("s", "size"),
            core_seconds=("cpu_time", "sum"),
            longest=("s", "max"),
            memory=("max_rss", "max"),
        )
    )
    return table.sort_values("core_seconds", ascending=False, ignore_index=True)


def _largest(configuration: dict) -> int:
    """Number of particles of the largest clouds that settle at every volume fraction."""
    settle = configuration["sedimentation"]
    return max(settle["long"]["particles"] or settle["particles"])


def _cases(table: pd.DataFrame, model: str) -> pd.DataFrame:
    """Rows of a model at the lowest Galileo number of each cloud."""
    own = table[table["model"] == model]
    keys = [name for name in ("quantity", "n", "volume_fraction") if name in own]
    return own.sort_values("galileo").drop_duplicates(keys)


def _steady_columns(velocity: pd.DataFrame) -> pd.DataFrame:
    half = (velocity["high"] - velocity["low"]) / 2
    columns = ["model", "n", "volume_fraction", "galileo", "status", "value", "half", "end"]
    return velocity.assign(half=half)[
        [*columns, "drift", "drift_error", "window", "spacings", "runs"]
    ]


def _with_paper(table: pd.DataFrame, paper: pd.DataFrame) -> pd.DataFrame:
    # Powers of ten that went through a file are compared by their digits.
    key = paper["volume_fraction"].map("{:.6e}".format)
    own = table["volume_fraction"].map("{:.6e}".format)
    relation = own.map(dict(zip(key, paper["relation"].replace("=", None), strict=True)))
    return table.assign(
        paper=own.map(dict(zip(key, paper["value"], strict=True))), relation=relation
    )


def _by_component(table: pd.DataFrame, keys: Sequence[str], values: Sequence[str]) -> pd.DataFrame:
    """Columns like r2_streamwise and r2_lateral: the first rows of each key, all decades."""
    first = table.drop_duplicates([*keys, "component"])
    found = first[list(keys)].drop_duplicates()
    for component in COMPONENTS:
        own = first[first["component"] == component]
        columns = {value: f"{value}_{component}" for value in values}
        found = found.merge(own[[*keys, *values]].rename(columns=columns), on=list(keys))
    return found


def paper_training(history: pd.DataFrame) -> pd.DataFrame:
    """The training in the paper's way: both components at some epochs, best errors until then."""
    best = history.assign(best=history.groupby("component")["validation_error"].cummin())
    table = best.pivot(index="epoch", columns="component", values=["best", "r2"])
    table.columns = [f"{component}_{name}" for name, component in table.columns]
    last = table.index.max()
    epochs = sorted({epoch for epoch in (100, 300, 1000, 3000, 10_000) if epoch < last} | {last})
    return table.ffill().loc[epochs].reset_index()


def _in_order(table: pd.DataFrame, column: str, names: Sequence[str]) -> pd.DataFrame:
    rank = table[column].map(list(names).index)
    return table.iloc[np.argsort(rank, kind="stable")].reset_index(drop=True)


STEADY_STATE = "results/analysis/steady_state.csv"
FROZEN_CLOUD = "results/figures/frozen_cloud.csv"
SOLVER_BENCHMARK = "results/benchmarks/solver.csv"
STRESS = "results/benchmarks/stress.csv"

TABLES: dict[str, tuple[Callable[..., pd.DataFrame], tuple[str, ...]]] = {
    "pairs": (pairs, ()),
    "meshes": (
        meshes,
        ("results/analysis/mesh_study.csv", "results/analysis/grid_convergence.csv"),
    ),
    "random_scenes": (random_scenes, (SOLVER_BENCHMARK,)),
    "methods": (methods, (SOLVER_BENCHMARK,)),
    "spheres": (pd.DataFrame, ("results/benchmarks/spheres.csv",)),
    "strain": (strain, (STRESS,)),
    "crowds": (crowds, (STRESS,)),
    "moving": (methods, ("results/benchmarks/moving.csv",)),
    "moving_estimates": (coverage, ("results/benchmarks/moving_estimates.csv",)),
    "moving_cost": (pd.DataFrame, ("results/benchmarks/moving_cost.csv",)),
    "scenes": (scenes, ("results/dataset/summary.csv",)),
    "forces": (forces, ("results/dataset/summary.json",)),
    "scores": (scores, ("results/model/evaluation.csv", "results/model/symmetries.csv")),
    "learning_curve": (learning_curve, ("results/model/learning_curve.csv",)),
    "ablation": (ablation, ("results/model/ablation.csv",)),
    "sweep": (sweep, ("results/sweep/summary.csv",)),
    "cost": (cost, ("results/figures/accuracy_vs_cost.csv",)),
    "settling": (settling, (STEADY_STATE, CONFIGURATION)),
    "galileo": (galileo, (STEADY_STATE, CONFIGURATION)),
    "models": (models, (STEADY_STATE, CONFIGURATION)),
    "oseen": (oseen, (CONFIGURATION,)),
    "independence": (pd.DataFrame, ("results/analysis/independence_of_n.csv",)),
    "neighbour_numbers": (neighbour_numbers, ("results/studies/neighbour_numbers.csv",)),
    "audit": (audit, ("results/analysis/audit.csv",)),
    "all_particles": (all_particles, (STEADY_STATE,)),
    "frozen_cloud": (frozen_cloud, (FROZEN_CLOUD,)),
    "neighbours": (neighbours, (FROZEN_CLOUD,)),
    "steps": (pd.DataFrame, ("results/studies/step_size.csv",)),
    "changes": (changes, ("results/analysis/neighbour_changes.csv", CONFIGURATION)),
    "fluctuations": (
        fluctuations,
        (
            "results/figures/cloud_spectra.csv",
            "results/figures/phase_and_spectra.csv",
            "results/figures/ergodicity.csv",
        ),
    ),
    "voronoi": (voronoi, ("results/figures/voronoi_variance.csv", CONFIGURATION)),
    "run_times": (run_times, ("benchmarks",)),
}
"""Each table of the page of validation: the function that reduces its sources to it, and these."""

CLOSURE_TABLES: dict[str, tuple[Callable[..., pd.DataFrame], tuple[str, ...]]] = {
    "closures": (closures, ("results/figures/closures.csv",)),
    "back_flow": (back_flow, (STEADY_STATE,)),
    "all_particles": (all_particles, (STEADY_STATE,)),
    "moving_spheres": (pd.DataFrame, ("results/studies/moving_spheres.csv",)),
    "settling_cost": (settling_cost, ("results/benchmarks/settling.csv",)),
}
"""The same of the page of all particles."""

PAPER_TABLES: dict[str, tuple[Callable[..., pd.DataFrame], tuple[str, ...]]] = {
    "settling": (apparent, (STEADY_STATE, CONFIGURATION)),
    "neighbour_numbers": (neighbour_numbers, ("results/studies/neighbour_numbers.csv",)),
    "steps": (pd.DataFrame, ("results/studies/step_size.csv",)),
    "training": (paper_training, ("results/studies/paper_training.csv",)),
}
"""The same of the page that goes through the paper."""

PAGES = {"validation": TABLES, "all_particles": CLOSURE_TABLES, "paper": PAPER_TABLES}
"""Pages that are written from a campaign, docs/<name>.md from docs/<name>.md.jinja and the tables
in docs/<name>/."""


def collect(campaign: Path, target: Path, found: Provenance, tables=None) -> None:
    """Write tables, by default `TABLES`, configuration and provenance of a campaign to a folder.

    A table is left out, and one of a former campaign removed, where a source is missing from the
    folder `campaign`, or where it has no rows. Raises FileNotFoundError where the campaign has not
    even its configuration; what fails leaves the folder as it is.
    """
    configuration = (campaign / CONFIGURATION).read_bytes()
    reduced = {
        name: reduce(*(_read(campaign / path) for path in paths))
        for name, (reduce, paths) in (TABLES if tables is None else tables).items()
        if all((campaign / path).exists() for path in paths)
    }
    target.mkdir(parents=True, exist_ok=True)
    for old in target.glob("*.csv"):
        old.unlink()
    (target / "config.yaml").write_bytes(configuration)
    for name, table in reduced.items():
        if not table.empty:
            table.to_csv(target / f"{name}.csv", index=False)
    text = json.dumps(found._asdict(), indent=2)
    (target / "provenance.json").write_text(text + "\n", encoding="utf-8")


def _read(path: Path) -> pd.DataFrame | dict | Path:
    """What a source holds; of a folder, its path."""
    match path.suffix:
        case ".csv":
            return pd.read_csv(path)
        case ".json":
            return json.loads(path.read_text(encoding="utf-8"))
        case ".yaml":
            return yaml.safe_load(path.read_text(encoding="utf-8"))
    return path


def copy_pictures(campaign: Path, target: Path) -> None:
    """Copy the pictures that the docs show, as far as the campaign has made them."""
    for name, path in PICTURES.items():
        if (campaign / path).exists():
            shutil.copyfile(campaign / path, target / name)


def page(template: Path, folder: Path) -> str:
    """The page that a template and the tables of a folder make."""
    return render(
        template,
        read_tables(folder),
        provenance=json.loads((folder / "provenance.json").read_text(encoding="utf-8")),
        config=yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8")),
        title=model_title,
    )

"""Each figure draws exactly the numbers of its table, also when read back from its CSV."""

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

from dustfall import figures
from dustfall.analysis.correlations import predictions_against_target, spearman_by_neighbours
from dustfall.analysis.distributions import force_distributions, force_samples
from dustfall.analysis.evaluation import error_by_gap
from dustfall.analysis.mesh_study import mesh_study_table
from dustfall.analysis.settling import inverse_beta_table
from dustfall.analysis.sketches import on_page, sketches_table
from dustfall.figures.closures import PANELS
from dustfall.figures.settling import ADAPTED, WINDOWS
from dustfall.figures.style import (
    PHI_RANGE,
    STYLE,
    log_scale,
    model_look,
    new_figure,
    phi_colour,
    phi_label,
    save,
)
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.registry import FORCE_MODELS, title, trained_models

PHI = (1e-8, 1e-5, 1e-3)


def rng():
    return np.random.default_rng(11)


def forces(m=400):
    r = rng()
    phi = 10 ** r.uniform(-8, -3, m)
    spread = (phi / 1e-3) ** 0.2
    force = r.laplace(scale=0.3, size=(m, 3)) * spread[:, None]
    force[:, 1] = 24 - 8 * spread * r.uniform(size=m)
    return phi, force


def waves(columns):
    """Curves of three particles at three volume fractions."""
    t = np.linspace(0, 10, 20)
    return pd.concat(
        [
            pd.DataFrame({"volume_fraction": phi, "n": 1000, "particle": p} | columns(t, phi, p))
            for phi in PHI
            for p in (1, 2, 3)
        ],
        ignore_index=True,
    )


def force_scatter():
    return force_samples(*forces(), number=100)


def force_pdf():
    return force_distributions(*forces(), points=60)


def spearman():
    return spearman_by_neighbours(rng().normal(size=(60, 5, 3)), forces(60)[1])


def predicted_vs_target():
    target = forces(50)[1]
    models = {"idnn": 0.98 * target, "dense": 0.9 * target, "anchored": target}
    return predictions_against_target(target, models)


def error_by_distance():
    phi, target = forces(90)
    return error_by_gap({"idnn": 0.98 * target, "anchored": 1.001 * target}, target, phi * 1e6, 9)


def learning_curve():
    rows = [
        {
            "model": model,
            "component": component,
            "radial_law": law,
            "training_scenes": scenes,
            "r2": 1 - error / scenes,
        }
        for model, error in (("idnn", 10.0), ("anchored", 0.1))
        for component in ("streamwise", "lateral")
        for law in ("uniform", "ball")
        for scenes in (250, 1000, 4000)
    ]
    return pd.DataFrame(rows)


def accuracy_vs_cost():
    return learning_curve().assign(microseconds=lambda table: table["training_scenes"] / 1e3)


def inverse_beta():
    steady = pd.DataFrame(
        [
            {
                "model": "idnn",
                "n": n,
                "volume_fraction": phi,
                "galileo": 0.078,
                "quantity": quantity,
                "status": "steady" if phi == 1e-3 else "drifting",
                "value": 1 + phi**0.2 if phi == 1e-3 else np.nan,
                "low": 0.99 + phi**0.2 if phi == 1e-3 else np.nan,
                "high": 1.01 + phi**0.2 if phi == 1e-3 else np.nan,
                "first": 1 + 0.9 * phi**0.2,
                "end": 1.01 + phi**0.2,
                "drift": 0.02,
                "runs": 1,
            }
            for quantity in ("settling_velocity_mean", "inverse_beta_mean")
            for n in (1000, 10000)
            for phi in PHI
        ]
    )
    other = steady[steady["n"] == 1000].assign(model="rotne_prager")
    return inverse_beta_table(pd.concat([steady, other]))


def settling_in_time():
    table = waves(lambda t, phi, p: {"time": t, "mean": 1 + phi * t, "variance": phi * t})
    table["n"] = table["particle"].map({1: 1000, 2: 10000, 3: 33000})
    table = table.drop(columns="particle").assign(model="idnn")
    table["spreading_times"] = table["time"] / 7
    window = table["n"].map(dict.fromkeys((1000, 33000), WINDOWS[0]) | {10000: WINDOWS[1]})
    return table.assign(window=window)


def phase_and_spectra():
    def panel(name, slope, x, y):
        def columns(t, phi, p):
            fields = {"panel": name, "x": x(t, phi), "y": y(t, phi)}
            return fields | {"slope": slope, "slope_error": 0.05, "units": "reduced"}

        return waves(columns)

    return pd.concat(
        [
            panel("phase", np.nan, lambda t, phi: 1 + phi**0.3 * np.sin(t), lambda t, phi: 1 + t),
            panel("spectrum", -2.0, lambda t, phi: 0.1 + t, lambda t, phi: phi * (0.1 + t) ** -2),
            panel("fit", -2.0, lambda t, phi: 0.1 + t, lambda t, phi: phi * (0.1 + t) ** -2),
        ],
        ignore_index=True,
    )


def closures():
    table = waves(lambda t, phi, p: {"x": 1 + t, "y": 1.5 + np.sin(t)})
    model = table["particle"].map({1: "anchored", 2: "anchored", 3: "all_particles"})
    table = table[table["volume_fraction"] == PHI[-1]].assign(model=model, low=np.nan, high=np.nan)
    table["n"] = table["particle"].map({1: 1000, 2: 10000, 3: 1000})
    return pd.concat([table.assign(panel=name, box=table["n"] / 10) for name in PANELS])


def lifetimes():
    table = waves(lambda t, phi, p: {"spreading_times": t, "correlation": np.exp(-p * t)})
    quantity = table["particle"].map({1: "membership", 2: "settling velocity", 3: None})
    return table.assign(quantity=quantity, n=1000).dropna(subset="quantity")


def trajectories():
    return waves(
        lambda t, phi, p: {"time": t, "dx": p * phi**0.2 * np.sin(t), "dy": p * t, "dz": -9 * t}
    )


def trajectories_3d():
    return trajectories()


def voronoi_pdf():
    volume = np.linspace(0.05, 3, 30)
    density = volume**4 * np.exp(-5 * volume)
    sources = {"random start": [np.nan], "settling": [1.0, 2.0, 4.0]}
    sources |= {"gamma, k = 5, theta = 0.2": [np.nan], "gamma, k = 5.59": [np.nan]}
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "source": source,
                    "galileo_multiple": multiple,
                    "volume": volume,
                    "density": (1 + 0.1 * i) * density,
                    "low": 0.9 * density,
                    "high": 1.5 * density,
                }
            )
            for source, multiples in sources.items()
            for i, multiple in enumerate(multiples)
        ],
        ignore_index=True,
    )


def voronoi_variance():
    rows = [
        {
            "source": source,
            "n": n,
            "volume_fraction": phi,
            "galileo": 0.078,
            "status": "steady" if phi == 1e-3 else "drifting",
            "relation": "<=",
            "inverse_beta_relation": ">=",
            "variance": 0.9 + phi**0.3,
            "low": 0.85 + phi**0.3,
            "high": 0.95 + phi**0.3,
            "inverse_beta": 1 + phi**0.2,
            "inverse_beta_low": 0.99 + phi**0.2,
            "inverse_beta_high": 1.01 + phi**0.2,
        }
        for source in ("simulation", "random spheres", "random points", "paper")
        for n in (1000, 10000)
        for phi in PHI
    ]
    return pd.DataFrame(rows)


def frozen_cloud():
    def rows(panel, source, x, phi=1e-3):
        y = 1 - 0.1 * np.asarray(x, dtype=float) ** 0.2
        head = {"panel": panel, "source": source, "volume_fraction": phi}
        return pd.DataFrame(head | {"x": x, "y": y, "low": y - 0.01, "high": y + 0.01})

    tables = [rows("neighbours", "nearest neighbours", [1.0, 5.0, 50.0], phi) for phi in PHI]
    tables += [rows("particles", "one cloud", rng().uniform(0.5, 0.8, 30)).drop(columns="low")]
    tables += [rows("correlation", "five neighbours, all particles", [1e-3])]
    sources = ("five neighbours", "all particles", "Batchelor 1972")
    tables += [rows("settling", source, list(PHI), list(PHI)) for source in sources]
    tables += [rows("drag", source, list(PHI), list(PHI)) for source in sources[:2]]
    return pd.concat(tables, ignore_index=True)


def cloud_spectra():
    t = np.linspace(0.01, 1, 20)
    tables = []
    for method in ("periodogram", "welch"):
        for phi in PHI:
            head = {"method": method, "volume_fraction": phi, "n": 1000}
            found = {"slope": -2.0, "slope_low": -2.1, "slope_high": -1.9, "units": "reduced"}
            for panel in ("density", "spectrum", "fit"):
                tables.append(
                    pd.DataFrame(head | {"panel": panel, "x": t, "y": phi / t**2} | found)
                )
    return pd.concat(tables, ignore_index=True)


def ergodicity():
    window = 2.0 ** np.arange(6)
    head = {"model": "idnn", "n": 1000, "window": window}
    tables = [pd.DataFrame(head | {"volume_fraction": p, "spread": window**-p}) for p in PHI]
    return pd.concat(tables, ignore_index=True)


def mesh_study():
    nodes = np.array([50, 100, 200])
    study = [
        pd.DataFrame(
            {"scheme": s, "nodes": nodes, "elements": 2 * nodes, "force": 24 - f / nodes}
        ).assign(limit=24.0, share=0.75 if s == "flat" else 1.0)
        for s, f in {"flat": 60.0, "projected": 2.0}.items()
    ]
    return mesh_study_table(pd.concat(study, ignore_index=True))


def neighbour_numbers():
    rows = [
        {
            "neighbours": number,
            "volume_fraction": phi,
            "status": "steady" if phi == 1e-3 else "too short",
            "value": 1 + number * phi**0.3,
            "half": 0.01,
            "as_paper": 1 + 0.9 * number * phi**0.3,
            "paper": {1e-5: 1.0826, 1e-3: 1.39}.get(phi, np.nan),
            "relation": {1e-5: "=", 1e-3: ">="}.get(phi),
        }
        for phi in PHI
        for number in (1, 4, 5, 50)
    ]
    return pd.DataFrame(rows)


def sketches():
    layers = {"streamwise": "40-40/30-30-30", "lateral": "20-20/10"}
    return sketches_table("idnn", layers, 5)


TABLES = {
    table.__name__: table
    for table in (
        force_scatter,
        force_pdf,
        spearman,
        predicted_vs_target,
        error_by_distance,
        learning_curve,
        accuracy_vs_cost,
        inverse_beta,
        settling_in_time,
        phase_and_spectra,
        cloud_spectra,
        ergodicity,
        closures,
        lifetimes,
        trajectories,
        trajectories_3d,
        frozen_cloud,
        voronoi_pdf,
        voronoi_variance,
        mesh_study,
        neighbour_numbers,
        sketches,
    )
}


def drawn_points(figure) -> set[tuple[float, float]]:
    """Data points of all lines and scatters of a figure."""
    points = []
    for ax in figure.axes:
        points += [line.get_xydata() for line in ax.lines]
        points += [c.get_offsets().data for c in ax.collections if hasattr(c, "get_sizes")]
    return {tuple(p) for p in np.concatenate(points).tolist()}


def pairs(frame, x, y) -> set[tuple[float, float]]:
    return set(zip(frame[x].astype(float), frame[y].astype(float), strict=True))


XY = {
    "force_scatter": ("volume_fraction", "force"),
    "force_pdf": ("force", "density"),
    "spearman": ("neighbours", "rho"),
    "predicted_vs_target": ("target", "predicted"),
    "error_by_distance": ("gap", "rms_error"),
    "inverse_beta": ("volume_fraction", "value"),
    "cloud_spectra": ("x", "y"),
    "ergodicity": ("window", "spread"),
    "closures": ("x", "y"),
    "lifetimes": ("spreading_times", "correlation"),
    "voronoi_pdf": ("volume", "density"),
    "voronoi_variance": ("inverse_beta", "variance"),
    "mesh_study": ("nodes", "force"),
    "neighbour_numbers": ("neighbours", "value"),
}


def test_every_figure_of_the_package_is_tested_here():
    assert set(TABLES) | {"save"} == set(figures.__all__)


@pytest.mark.parametrize("name", XY)
def test_all_numbers_of_the_table_are_drawn(name):
    table = TABLES[name]()
    if name == "inverse_beta":
        # Random starts of the largest cloud alone, and a range is no point.
        shown = (table["source"] != "random start") | (table["n"] == 10000)
        table = table[
            shown & (table["model"] != "rotne_prager") | (table["source"] == "simulation")
        ]
        table = table.dropna(subset=["value"])
    assert pairs(table, *XY[name]) <= drawn_points(getattr(figures, name)(table))


def test_panels_with_two_views_draw_both():
    table = trajectories()
    drawn = drawn_points(figures.trajectories(table))
    assert pairs(table, "dx", "dz") | pairs(table, "dx", "dy") <= drawn
    table = settling_in_time()
    drawn = drawn_points(figures.settling_in_time(table))
    moving = table[table["variance"] > 0]
    for window, clock in zip(WINDOWS, ("time", "spreading_times"), strict=True):
        own, positive = (t[t["window"] == window] for t in (table, moving))
        assert pairs(own, clock, "mean") | pairs(positive, clock, "variance") <= drawn
        for _, case in own.groupby(["volume_fraction", "n"]):
            later = case[case["time"] >= min(ADAPTED, case["time"].max() / 2)]
            change = 100 * (later["mean"] / later["mean"].iloc[0] - 1)
            assert pairs(later.assign(change=change), clock, "change") <= drawn
    table = phase_and_spectra()
    drawn = drawn_points(figures.phase_and_spectra(table))
    assert pairs(table[table["panel"] != "phase"], "x", "y") <= drawn
    for _, orbit in table[table["panel"] == "phase"].groupby(["volume_fraction", "particle"]):
        about = orbit.assign(x=orbit["x"] - orbit["x"].mean(), y=orbit["y"] - 1)
        assert pairs(about, "x", "y") <= drawn
    table = frozen_cloud().query("panel != 'correlation'")
    assert pairs(table, "x", "y") <= drawn_points(figures.frozen_cloud(frozen_cloud()))
    table = error_by_distance()
    assert pairs(table, "gap", "largest_error") <= drawn_points(figures.error_by_distance(table))
    table = learning_curve()
    drawn = drawn_points(figures.learning_curve(table))
    assert pairs(table.assign(left=1 - table["r2"]), "training_scenes", "left") <= drawn
    table = accuracy_vs_cost()
    drawn = drawn_points(figures.accuracy_vs_cost(table))
    assert pairs(table.assign(left=1 - table["r2"]), "microseconds", "left") <= drawn
    table = mesh_study()
    assert pairs(table, "nodes", "error") <= drawn_points(figures.mesh_study(table))


def test_force_models_stand_in_a_panel_of_their_own_at_the_n_that_they_share():
    left, right = figures.inverse_beta(inverse_beta()).axes
    assert left.get_title(loc="left") == f"(a) {title('idnn')}"
    assert r"1\,000" in right.get_title(loc="left")
    labels = [text.get_text() for text in right.get_legend().get_texts()]
    assert labels[:2] == [title("idnn"), title("rotne_prager")]


def test_only_steady_cases_have_filled_markers_and_a_range_of_others_leaves_the_axis_alone():
    table = inverse_beta()
    left, right = figures.inverse_beta(table).axes
    for ax in (left, right):
        marked = [line for line in ax.lines if line.get_marker() not in ("None", "*", "_")]
        filled = [line for line in marked if line.get_markerfacecolor() != "white"]
        assert {x for line in filled for x in line.get_xdata()} == {1e-3}
        assert {x for line in marked for x in line.get_xdata()} == set(PHI)
    assert table["high"].max() == 4
    assert right.get_ylim()[1] < 1.1 * table["value"].max()


def test_the_papers_bounds_have_an_arrow_each_and_its_points_none():
    ax = figures.inverse_beta(inverse_beta().assign(drift=0.0)).axes[0]
    assert [tuple(text.xy) for text in ax.texts] == [(1e-3, 1.39)]


def test_a_curve_crosses_one_at_the_number_of_neighbours_that_gives_the_papers_velocity():
    table = neighbour_numbers()
    left, right = figures.neighbour_numbers(table).axes
    for phi, paper in ((1e-5, 1.0826), (1e-3, 1.39)):
        (curve,) = [
            line for line in right.lines
            if line.get_color() == phi_colour(phi) and line.get_linestyle() == "-"
        ]  # fmt: skip
        # 1 + M phi^0.3 is the paper's where M is this.
        expected = (paper - 1) / phi**0.3
        number, excess = curve.get_xydata().T
        assert np.interp(1.0, excess, number) == pytest.approx(expected)
        assert number.max() == 5
    # The bound is an arrow, the other point none; a phi that the paper lacks has no curve.
    assert [tuple(text.xy) for text in left.texts] == [(5, 1.39)]


def test_the_share_of_nodes_on_the_sphere_stands_at_meshes_with_an_outer_sphere():
    left = figures.mesh_study(mesh_study()).axes[0]
    shares = {text.xy[0]: text.get_text() for text in left.texts}
    assert [shares[nodes] for nodes in (50, 100, 200)] == ["75 %"] * 3
    paper = [text.get_text() for text in left.texts if text.xy[0] not in (50, 100, 200)]
    assert paper == ["88 %", "92 %", "78 %", "77 %", "70 %", "72 %"]


def test_paths_in_space_keep_their_heights_and_cast_their_shadows_on_the_floor():
    table = trajectories()
    axes = figures.trajectories_3d(table).axes
    assert len(axes) == len(PHI)
    for ax, (_, rows) in zip(axes, table.groupby("volume_fraction"), strict=True):
        for _, path in rows.groupby("particle"):
            depth = 0.035 * 1.03 * table["dz"].min() * path["dy"]
            reach = 1.1 * rows[["dx", "dy"]].abs().to_numpy().max()
            expected = (path["dz"] - depth / reach).to_numpy()
            assert any(
                len(line.get_ydata()) == len(path) and np.allclose(line.get_ydata(), expected)
                for line in ax.lines
            )


def test_slices_share_an_axis_of_density_and_the_fitted_law_is_drawn_at_its_places():
    table = force_pdf()
    axes = np.array(figures.force_pdf(table).axes).reshape(-1, 2)
    assert len(axes) == table["slice"].nunique()
    for column, component in enumerate(("streamwise", "spanwise")):
        assert len({ax.get_ylim() for ax in axes[:, column]}) == 1
        for ax, (_, rows) in zip(axes[:, column], table.groupby("slice"), strict=True):
            own = rows[rows["component"] == component]
            drawn = {tuple(p) for line in ax.lines for p in line.get_xydata().tolist()}
            assert pairs(own, "force", "density") <= drawn
            if component == "spanwise":
                assert pairs(own, "force", "laplace_density") <= drawn


def assert_labels_fit(figure):
    """No legend or label leaves the page, and every row and column of panels has its axis named."""
    renderer, page = figure.canvas.get_renderer(), figure.bbox
    with mpl.rc_context(STYLE):  # mathtext picks its font when it is measured
        boxes = [legend.get_window_extent(renderer) for legend in figure.legends]
        boxes += [ax.get_tightbbox(renderer) for ax in figure.axes]
    for box in boxes:
        assert page.x0 - 1 <= box.x0 < box.x1 <= page.x1 + 1
        assert page.y0 - 1 <= box.y0 < box.y1 <= page.y1 + 1
    for ax in figure.axes:
        if not ax.axison:  # a drawing without scales
            continue
        place = ax.get_subplotspec()
        assert ax.get_xlabel() or not place.is_last_row()
        assert ax.get_ylabel() or not place.is_first_col()


def pixels(figure) -> np.ndarray:
    """Picture of a figure, as coarse as its labels allow."""
    with mpl.rc_context(STYLE):
        figure.set_dpi(50)
        figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba()).copy()


@pytest.mark.parametrize("name", TABLES)
def test_csv_draws_the_same_picture_with_all_its_labels(name, tmp_path):
    draw, table = getattr(figures, name), TABLES[name]()
    figure = draw(table)
    picture = pixels(figure)
    assert_labels_fit(figure)
    table.to_csv(tmp_path / "table.csv", index=False)
    again = pd.read_csv(tmp_path / "table.csv")
    np.testing.assert_array_equal(pixels(draw(again)), picture)


def test_saved_files_have_the_same_bytes_each_time_and_a_csv_that_reads_back_its_bits(tmp_path):
    table = ergodicity().assign(spread=lambda t: t["spread"] * np.pi)
    for folder in ("first", "second"):
        save(figures.ergodicity(table), table, tmp_path / folder / "ergodicity")
    for suffix in (".png", ".pdf", ".csv"):
        first, second = (tmp_path / f / f"ergodicity{suffix}" for f in ("first", "second"))
        assert first.read_bytes() == second.read_bytes()
    again = pd.read_csv(tmp_path / "first" / "ergodicity.csv")
    pd.testing.assert_frame_equal(again, table, rtol=0, atol=0)


@pytest.mark.parametrize("name", TABLES)
def test_empty_tables_and_missing_columns_are_refused(name):
    draw, table = getattr(figures, name), TABLES[name]()
    with pytest.raises(ValueError, match=f"{name} has 0 rows"):
        draw(table.iloc[:0])
    drawn = XY.get(name, ("volume_fraction",))[-1]
    others = {"learning_curve": "r2", "accuracy_vs_cost": "r2", "sketches": "width"}
    drawn = "dz" if name.startswith("trajectories") else others.get(name, drawn)
    with pytest.raises(ValueError, match=f"{name} lacks the column '{drawn}'"):
        draw(table.drop(columns=drawn))


@pytest.mark.parametrize(
    "name",
    [
        "force_pdf",
        "settling_in_time",
        "phase_and_spectra",
        "cloud_spectra",
        "ergodicity",
        "trajectories",
        "trajectories_3d",
        "frozen_cloud",
        "voronoi_pdf",
    ],
)
def test_a_curve_needs_two_rows(name):
    with pytest.raises(ValueError, match=f"{name} has 1 rows"):
        getattr(figures, name)(TABLES[name]().iloc[:1])


@pytest.mark.parametrize("name", ["force_scatter", "inverse_beta", "voronoi_variance"])
def test_one_sample_is_drawn(name):
    table = TABLES[name]()
    table = table.drop_duplicates("component") if name == "force_scatter" else table.iloc[:1]
    assert pairs(table, *XY[name]) <= drawn_points(getattr(figures, name)(table))


def test_tables_of_several_cases_are_refused_where_one_is_drawn():
    both = pd.concat([spearman(), spearman().assign(coordinates="cartesian")])
    with pytest.raises(ValueError, match="one kind of coordinates"):
        figures.spearman(both)
    with pytest.raises(ValueError, match="one model"):
        figures.settling_in_time(
            pd.concat([settling_in_time(), settling_in_time().assign(model="dense")])
        )
    for name in (
        "trajectories",
        "trajectories_3d",
        "phase_and_spectra",
        "cloud_spectra",
        "ergodicity",
    ):
        with pytest.raises(ValueError, match="one n"):
            getattr(figures, name)(pd.concat([TABLES[name](), TABLES[name]().assign(n=33000)]))
    with pytest.raises(ValueError, match="'simulation'"):
        figures.inverse_beta(inverse_beta().query("source == 'paper'"))
    for name in ("predicted_vs_target", "force_scatter", "force_pdf"):
        with pytest.raises(ValueError, match=f"{name} has no rows of component"):
            getattr(figures, name)(TABLES[name]().query("component == 'streamwise'"))


def test_no_two_force_models_look_alike_and_none_goes_by_its_name_in_code():
    looks = {tuple(model_look(model).values()) for model in FORCE_MODELS}
    assert len(looks) == len(FORCE_MODELS)
    campaign = [*FORMULAS, *trained_models()]
    assert len({model_look(model)["color"] for model in campaign}) == len(campaign)
    names = set(FORCE_MODELS)
    tables = {"predicted_vs_target", "error_by_distance", "learning_curve", "accuracy_vs_cost"}
    for name in tables | {"inverse_beta"}:
        figure = getattr(figures, name)(TABLES[name]())
        texts = {text.get_text() for text in figure.findobj(mpl.text.Text)}
        assert not texts & names, name


def test_sketches_show_the_scene_the_sizes_of_the_layers_and_the_flow_along_the_second_axis():
    table = sketches()
    scene, network, _ = figures.sketches(table).axes
    spheres = table[(table["panel"] == "domain") & table["kind"].isin(["reference", "neighbour"])]
    drawn = [patch.center for patch in scene.patches if hasattr(patch, "center")]
    np.testing.assert_allclose(drawn, on_page(spheres[["x", "y", "z"]]))
    centres = spheres[["x", "y", "z"]].to_numpy()
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)[np.triu_indices(6, 1)]
    assert apart.min() > 1.0
    assert (np.diff(np.linalg.norm(centres[1:], axis=1)) > 0).all()
    words = [text.get_text() for text in network.texts]
    # Three spherical coordinates a neighbour; the two components have their own layers.
    for size in ("6", "40 or 20", "3", "30 or 10", "1 or 2"):
        assert size in words
    arrows = table[table["panel"] == "frames"].set_index("kind")
    own = arrows.loc["own axis"]
    axes = own[["x", "y", "z"]].to_numpy() - own[["from_x", "from_y", "from_z"]].to_numpy()
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    flow = arrows.loc["flow"]
    flow = flow[["x", "y", "z"]].to_numpy() - flow[["from_x", "from_y", "from_z"]].to_numpy()
    np.testing.assert_allclose(axes @ flow.astype(float), [0, np.linalg.norm(flow), 0], atol=1e-12)


def test_the_side_view_is_stretched_as_it_says():
    figure = figures.trajectories(trajectories())
    figure.canvas.draw()
    side = figure.axes[len(PHI)]
    (x0, z0), (x1, z1) = side.transData.transform([(0, 0), (1, 1)])
    stretch = float(side.get_ylabel().split("$")[1].split("\\times")[0])
    assert (x1 - x0) / (z1 - z0) == pytest.approx(stretch, rel=0.05)
    (x0, y0), (x1, y1) = figure.axes[0].transData.transform([(0, 0), (1, 1)])
    assert x1 - x0 == pytest.approx(y1 - y0)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.4, 4.0, {"0.5", "1", "2", "3"}),
        (0.02, 0.09, {"0.02", "0.03", "0.05"}),
        (2e-6, 9e-6, {f"${k}\\times 10^{{-6}}$" for k in (2, 3, 5)}),
        (1e-6, 1.0, {f"$10^{{{k}}}$" for k in range(-6, 1)}),
    ],
)
def test_logarithmic_axes_have_whole_powers_or_plain_numbers(low, high, expected):
    figure = new_figure(3, 3)
    ax = figure.subplots()
    log_scale(ax, "y")
    ax.set_ylim(low, high)
    figure.canvas.draw()
    labels = ax.get_yticklabels() + ax.get_yticklabels(minor=True)
    shown = {t.get_text() for t in labels if low <= t.get_position()[1] <= high} - {""}
    assert shown == expected


def test_the_axes_of_spectra_have_the_units_of_their_table():
    for name in ("cloud_spectra", "phase_and_spectra"):
        figure = getattr(figures, name)(TABLES[name]().assign(units="SI"))
        labels = {ax.get_xlabel() for ax in figure.axes} | {ax.get_ylabel() for ax in figure.axes}
        assert any("1/m" in label for label in labels)
        assert not any("d_p" in label or "tau" in label for label in labels)


def test_r2_and_slope_stand_in_the_panels():
    table = predicted_vs_target()
    texts = [t.get_text() for ax in figures.predicted_vs_target(table).axes for t in ax.texts]
    dense = table[(table["model"] == "dense") & (table["component"] == "lateral")]["r2"].iloc[0]
    assert f"$R^2 = {dense:.3f}$" in texts or any(f"{dense:.4f}" in t for t in texts)
    spectra = figures.phase_and_spectra(phase_and_spectra())
    notes = [t.get_text() for ax in spectra.axes for t in ax.texts]
    assert sum("-2.00 \\pm 0.05" in n for n in notes) == 3


def test_volume_fractions_have_their_own_colours_from_pale_to_dark():
    colours = np.array([phi_colour(10.0**k)[:3] for k in range(-8, -2)])
    luminance = colours @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) < -0.03).all()
    assert phi_colour(1e-12) == phi_colour(PHI_RANGE[0])
    assert phi_label(1e-5) == "$10^{-5}$"
    assert phi_label(2.5e-4) == "$2.5\\times 10^{-4}$"


def test_a_failed_save_leaves_the_old_files(tmp_path):
    table = mesh_study()
    figure = figures.mesh_study(table)
    save(figure, table, tmp_path / "mesh_study")
    before = (tmp_path / "mesh_study.png").read_bytes()
    figure.axes[0].set_title("$\\nosuchcommand$")
    with pytest.raises(ValueError, match="nosuchcommand"):
        save(figure, table, tmp_path / "mesh_study")
    assert (tmp_path / "mesh_study.png").read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 3

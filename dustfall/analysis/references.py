"""Numbers of others that the figures show beside ours, each with its source."""

import pandas as pd

PAPER_MESH_STUDY = pd.DataFrame(
    {
        "nodes": [212.04, 346.16, 547.91, 827.11, 1088.37, 1506.72],
        "force": [10.0435, 17.5225, 19.8189, 22.1898, 23.2453, 24.3809],
        "share": [0.88, 0.92, 0.78, 0.77, 0.70, 0.72],
    }
)
"""Force on an isolated sphere [Re_p c_D] against the nodes of sphere and outer sphere together, and
the share of the nodes on the sphere (paper, figure of the mesh validation study, read from the
points and labels that its source lists)."""

PAPER_NEIGHBOURS = 5
"""Neighbours that a particle feels in the paper, as it writes."""

PAPER_WINDOW = (50.0, 100.0)
"""Times [tau] between which the paper averages, as read here: it gives the first alone."""

PAPER_SETTLING = pd.DataFrame(
    [
        ("inverse_beta", 1e-3, 1.39, ">=", "tip of a drawn arrow that stops short of its point"),
        ("inverse_beta", 1e-4, 1.1835, "=", "coordinate of a drawn point"),
        ("inverse_beta", 1e-5, 1.0826, "=", "coordinate of a drawn point"),
        ("voronoi_variance", 1e-3, 1.2381, "=", "coordinate of a drawn point"),
        (
            "voronoi_variance",
            1e-4,
            1.04,
            "<=",
            "tip of a drawn arrow that stops short of its point",
        ),
        (
            "voronoi_variance",
            1e-5,
            0.97,
            "<=",
            "tip of a drawn arrow that stops short of its point",
        ),
    ],
    columns=["quantity", "volume_fraction", "value", "relation", "origin"],
)
"""What the paper's figures of 1/beta and of the Voronoï variance hold: the settling velocity in
units of the Stokes velocity, and the variance of V/mean(V) over k theta^2 = 0.2, in the steady
state. They are drawn by hand: numbers of four digits are data, round ones are where arrows end, and
bound the value (`relation`). Below 1e-5 there are labels and arrows, and no point with a source."""

DEL_BELLO = {"volume_fraction": 1e-3, "low": 1.0, "high": 4.0}
"""Range, and no points, as these are not published. Volcanic ash (125 to 500 micrometres) in air,
in the laboratory and in two- and four-way coupled simulations, phi = 1e-7 to 1e-3: particles that
settle together exceed a lone one's velocity by up to 4 times at phi of about 1e-3 (Del Bello et al.
2017, doi:10.1038/srep39620, abstract)."""

POISSON_VORONOI_VARIANCE = 0.179032
"""Variance of V/mean(V) of the Voronoï cells of random points (integral of Gilbert 1962)."""

PAPER_GAMMA = (5.0, 0.2)
"""Shape k and scale theta of the gamma law of the paper; k = (3 d + 1)/2 in d = 3 dimensions
(Ferenc & Néda 2007). Its variance, k theta^2 = 0.2, is larger than that of random points."""

MATCHED_GAMMA = (1 / POISSON_VORONOI_VARIANCE, POISSON_VORONOI_VARIANCE)
"""Gamma law with mean one and the variance of random points: k = 5.59."""

PAPER_FORCE_SUMMARY = {
    ("reduction_exceeded_by_30_percent", "streamwise"): 0.15,
    ("reduction_exceeded_by_10_percent", "streamwise"): 0.34,
    ("share_15_percent_below_stokes", "streamwise"): 0.30,
    ("share_34_percent_below_stokes", "streamwise"): 0.10,
    ("mean", "spanwise"): 0.0,
    ("mean", "vertical"): 0.0,
    ("variance", "spanwise"): 0.126,
    ("variance", "vertical"): 0.124,
}
"""What the paper states of its 14,000 forces (section "Interpretation of the BEM results")."""

PAPER_SCORES = pd.DataFrame(
    [("idnn", 0.996, 0.961), ("dense", 0.968, 0.303)],
    columns=["model", "r2_streamwise", "r2_lateral"],
)
"""R^2 that the paper reports of its models (written into its figure of predicted against true
forces), the dense network with its neighbours in any order."""

"""One function a figure, from the tidy table that is saved beside it to a matplotlib Figure."""

from dustfall.figures.closures import closures, lifetimes
from dustfall.figures.fluctuations import cloud_spectra, ergodicity
from dustfall.figures.forces import (
    accuracy_vs_cost,
    error_by_distance,
    force_pdf,
    force_scatter,
    learning_curve,
    predicted_vs_target,
    spearman,
)
from dustfall.figures.frozen_cloud import frozen_cloud
from dustfall.figures.mesh import mesh_study
from dustfall.figures.neighbours import neighbour_numbers
from dustfall.figures.settling import (
    inverse_beta,
    phase_and_spectra,
    settling_in_time,
    trajectories,
    trajectories_3d,
)
from dustfall.figures.sketches import sketches
from dustfall.figures.style import save
from dustfall.figures.voronoi import voronoi_pdf, voronoi_variance

__all__ = [
    "accuracy_vs_cost",
    "closures",
    "cloud_spectra",
    "ergodicity",
    "error_by_distance",
    "force_pdf",
    "force_scatter",
    "frozen_cloud",
    "inverse_beta",
    "learning_curve",
    "lifetimes",
    "mesh_study",
    "neighbour_numbers",
    "phase_and_spectra",
    "predicted_vs_target",
    "save",
    "settling_in_time",
    "sketches",
    "spearman",
    "trajectories",
    "trajectories_3d",
    "voronoi_pdf",
    "voronoi_variance",
]

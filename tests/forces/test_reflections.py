import numpy as np
import pytest

from dustfall.forces.formulas.reflections import MODEL as REFLECTED
from dustfall.forces.formulas.reflections import REFLECTIONS
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.scenes import random_scenes
from dustfall.stokes.references.exact_pairs import pair_drag
from dustfall.suspension.few_spheres import TERMS, forces_among_neighbours
from dustfall.suspension.rotne_prager import rotne_prager_forces
from tests.forces.scenes import random_neighbours

RADIUS = 0.5


def scenes_of(*neighbours):
    """One scene of these neighbours, filled up to five by spheres out of reach."""
    far = 1e9 * np.random.default_rng(0).normal(size=(5 - len(neighbours), 3))
    return np.concatenate([np.reshape(neighbours, (-1, 3)), far])[None]


@pytest.mark.parametrize(("axis", "which"), [(1, 0), (0, 1), (2, 1)])
def test_two_spheres_have_the_exact_force_at_every_distance(axis, which):
    distance = np.concatenate([1 + np.logspace(-6, 1, 40), [1.0, 50.0, 1e3]])
    scenes = np.concatenate([scenes_of(r * np.eye(3)[axis]) for r in distance])
    force = REFLECTED.predict(scenes)
    np.testing.assert_allclose(force[:, 1] / 24, pair_drag(distance)[which], rtol=0, atol=1e-6)
    np.testing.assert_allclose(force[:, [0, 2]], 0, atol=1e-7)


# Force / isolated drag on the reference sphere at a spacing of 1.5 d_p, by two independent methods
# (multipoles and boundary elements).
CHAIN_END, CHAIN_MIDDLE, TRIANGLE = 0.646844, 0.442714, 0.662821


@pytest.mark.parametrize(
    ("neighbours", "expected"),
    [
        ([[0, 1.5, 0], [0, 3, 0]], CHAIN_END),
        ([[0, 1.5, 0], [0, -1.5, 0]], CHAIN_MIDDLE),
        ([[1.5, 0, 0], [0.75, 0, 1.5 * np.sqrt(0.75)]], TRIANGLE),
    ],
)
def test_three_spheres_are_within_two_per_cent_of_their_deviation_from_stokes(neighbours, expected):
    force = REFLECTED.predict(scenes_of(*neighbours))[0, 1] / 24
    formula = ROTNE_PRAGER.predict(scenes_of(*neighbours))[0, 1] / 24
    assert abs(force - expected) < 0.02 * (1 - expected)
    assert abs(force - expected) < 0.5 * abs(formula - expected)


def test_compiled_reflections_equal_the_formula_with_differentiated_velocity_fields():
    neighbours, _ = random_scenes(3, "uniform", range(4), (5e-3, 5e-3))
    compiled = forces_among_neighbours(neighbours, REFLECTIONS, np.zeros((2, TERMS)))
    plain = [reflected(np.vstack([np.zeros(3), scene]))[0] for scene in neighbours]
    np.testing.assert_allclose(compiled, plain, rtol=1e-7, atol=1e-7)


def reflected(centres):
    """Forces (n, 3) by the method of reflections, from numerical derivatives of velocity fields."""
    n = len(centres)
    mobility = np.array([[block(i, j, centres) for j in range(n)] for i in range(n)])
    mobility = mobility.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    gradient = np.zeros((n, 3, 3, n, 3))
    for i in range(n):
        for j in set(range(n)) - {i}:
            r = centres[i] - centres[j]
            # Faxen's law: a^2/10 for the strain; the Laplacian of the field has no rotation.
            strain = derivative(r, RADIUS**2 * (1 / 6 + 1 / 10))
            plain = derivative(r, 0.0)
            gradient[i, :, :, j] = (strain + strain.swapaxes(0, 1)) / 2
            gradient[i, :, :, j] += (plain - plain.swapaxes(0, 1)) / 2
    symmetric = (gradient + gradient.swapaxes(1, 2)) / 2
    # Stresslet and torque of a held sphere over 6 pi mu a, the torque as an antisymmetric tensor.
    response = RADIUS**2 * (10 / 9 * symmetric + 2 / 3 * (gradient - symmetric))
    reflect = gradient.reshape(9 * n, 3 * n).T @ response.reshape(9 * n, 3 * n)
    force = np.linalg.solve(mobility, np.tile([0.0, 1.0, 0.0], n))
    total = force.copy()
    for _ in range(REFLECTIONS):
        force = np.linalg.solve(mobility, reflect @ force)
        total += force
    return 24 * total.reshape(n, 3)


def block(i, j, centres):
    return np.eye(3) if i == j else field(centres[i] - centres[j], RADIUS**2 / 3)


def field(r, laplacians):
    """(1 + laplacians * Laplacian) of the Oseen tensor, over the isolated sphere's mobility."""
    distance = np.linalg.norm(r)
    dyad = np.outer(r, r) / distance**2
    oseen = (np.eye(3) + dyad) / distance
    return 0.375 * (oseen + laplacians * 2 * (np.eye(3) - 3 * dyad) / distance**3)


def derivative(r, laplacians, step=1e-4):
    """d field_ik / d r_l as [i, l, k], by central differences of fourth order."""
    columns = []
    for shift in step * np.eye(3):
        near = field(r + shift, laplacians) - field(r - shift, laplacians)
        far = field(r + 2 * shift, laplacians) - field(r - 2 * shift, laplacians)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=1)


def test_without_reflections_the_rotne_prager_inverse_is_left():
    neighbours = random_neighbours(9, farthest=20.0)
    plain = [rotne_prager_forces(np.vstack([np.zeros(3), scene]))[0] for scene in neighbours]
    compiled = forces_among_neighbours(neighbours, 0, np.zeros((2, TERMS)))
    np.testing.assert_allclose(compiled, plain, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("overlap", [False, True])
def test_force_keeps_the_symmetries_of_stokes_flow(overlap):
    neighbours = random_neighbours(70)
    if overlap:  # of neighbours with each other, and with the reference sphere
        neighbours[:, 1] = neighbours[:, 0] + 0.05 * neighbours[:, 2]
        neighbours[:20, 3] *= 0.02
    force = REFLECTED.predict(neighbours)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    turned = REFLECTED.predict(neighbours @ turn.T)
    np.testing.assert_allclose(turned, force @ turn.T, atol=1e-11)
    mirrored = REFLECTED.predict(neighbours * [-1, 1, 1])
    np.testing.assert_allclose(mirrored, force * [-1, 1, 1], atol=1e-11)
    np.testing.assert_allclose(REFLECTED.predict(-neighbours), force, atol=1e-11)


def test_overlapping_neighbours_keep_the_force_finite_and_below_stokes():
    neighbours = random_neighbours(50, farthest=9.0)
    neighbours[:, 1] = neighbours[:, 0]
    neighbours[:25, 1] += 0.2
    neighbours[40:] *= 1e-3
    streamwise = REFLECTED.predict(neighbours)[:, 1]
    assert (streamwise < 24).all()
    assert (streamwise > 0).all()

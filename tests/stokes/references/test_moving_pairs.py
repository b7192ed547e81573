"""Two spheres that move: what is known of each mode of motion, near contact, far apart, between."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import zeta

from dustfall.stokes.references.exact_pairs import pair_drag
from dustfall.stokes.references.moving_pairs import loads_on_two_spheres, pair_resistance

MATRICES = {
    "along": (1.0, 0.5),
    "about": (1.0,),
    "across": (1.0, 1.0 / 3.0, 2.0 / 3.0),
    "planar": (1.0,),
}
"""Work of each load over that of a force, for the same number in its own unit."""


def energies(gap, radii):
    """Each matrix as a quadratic form: twice the dissipation over 3 pi mu d_p U^2."""
    for name, matrix in vars(pair_resistance(gap, radii)).items():
        yield np.tile(MATRICES[name], 2)[:, None] * matrix


@pytest.mark.parametrize(
    ("s", "known"), [(3.0, 2.038655), (2.1, 7.413298), (2.02, 28.114022), (2.002, 254.143204)]
)
def test_approaching_spheres_feel_what_brenner_found(s, known):
    """Brenner 1961, a sphere and a plane free of shear: over 6 pi mu a U."""
    along = pair_resistance(0.5 * s - 1.0).along
    assert along[0, 0] - along[0, 2] == pytest.approx(known, abs=5.1e-7)


@pytest.mark.parametrize("gap", [1e-4, 1e-3, 0.05, 0.5, 3.0, 100.0])
def test_spheres_that_move_as_one_feel_the_drag_of_fixed_ones(gap):
    """The lubrication of both spheres, up to 1e4 here, cancels to ten digits."""
    found = pair_resistance(gap)
    along, across = pair_drag(1.0 + gap)
    assert found.along[0, [0, 2]].sum() == pytest.approx(along, abs=2e-11)
    assert found.across[0, [0, 3]].sum() == pytest.approx(across, abs=1e-12)


def test_equal_spheres_near_contact_follow_jeffrey_and_onishi():
    """Jeffrey and Onishi 1984: lubrication and the constants of their tables, four digits."""
    xi = 2e-5
    log = np.log(1.0 / xi)
    found = pair_resistance(0.5 * xi)
    near = 0.25 / xi + 9.0 / 40.0 * log
    constants = [
        (found.along[0, 0] - near, 0.9954),
        (found.along[0, 2] + near, -0.3502),
        (found.across[0, 0] - log / 6.0, 0.9983),
        (found.across[0, 3] + log / 6.0, -0.2737),
        (found.across[1, 1] - log / 5.0, 0.7028),
        (found.across[1, 4] - log / 20.0, -0.0274),
        (found.about[0, 0], 7.0 / 8.0 * zeta(3.0)),
        (found.about[0, 1], -zeta(3.0) / 8.0),
    ]
    for value, known in constants:
        assert value == pytest.approx(known, abs=1.3e-4)


@pytest.mark.parametrize("ratio", [0.5, 4.0])
def test_lubrication_of_unequal_spheres_follows_jeffrey_and_onishi(ratio):
    """What is left of X11A and Y11A after their singular terms changes as xi, not as log xi."""
    g1 = 2.0 * ratio**2 / (1.0 + ratio) ** 3
    g2 = ratio * (1.0 + 7.0 * ratio + ratio**2) / (5.0 * (1.0 + ratio) ** 3)
    g3 = np.polyval([1, 18, -29, 18, 1], ratio) / (42.0 * (1.0 + ratio) ** 3)
    h2 = 4.0 * ratio * (2.0 + ratio + 2.0 * ratio**2) / (15.0 * (1.0 + ratio) ** 3)
    h3 = 2.0 * np.polyval([16, -45, 58, -45, 16], ratio) / (375.0 * (1.0 + ratio) ** 3)
    left = []
    for xi in (4e-3, 2e-3, 1e-3):
        found = pair_resistance(0.25 * xi * (1.0 + ratio), (0.5, 0.5 * ratio))
        log = np.log(1.0 / xi)
        near = g1 / xi + (g2 + g3 * xi) * log, (h2 + h3 * xi) * log
        left.append([found.along[0, 0] - near[0], found.across[0, 0] - near[1]])
    first, second = np.abs(np.diff(left, axis=0))
    assert (first < 2e-3).all()
    np.testing.assert_allclose(second / first, 0.5, atol=0.03)


@pytest.mark.parametrize("radii", [(0.5, 0.5), (0.5, 1.0), (5.0, 0.5), (0.02, 0.03)])
@pytest.mark.parametrize("gap", [1e-3, 0.02, 1.0, 30.0])
def test_resistance_is_symmetric_and_positive(gap, radii):
    """Lorentz reciprocity and dissipation."""
    for energy in energies(gap, radii):
        size = np.sqrt(np.diag(energy))
        scaled = energy / np.outer(size, size)
        np.testing.assert_allclose(scaled, scaled.T, atol=1e-12)
        assert np.linalg.eigvalsh(scaled).min() > 0.0


def test_symmetry_holds_at_the_narrowest_gap_that_is_promised():
    for energy in energies(1e-4, (0.5, 0.5)):
        size = np.sqrt(np.diag(energy))
        np.testing.assert_allclose((energy - energy.T) / np.outer(size, size), 0.0, atol=1e-12)


def random_motion(seed):
    """Velocities, angular velocities, flow and a gradient without trace."""
    rng = np.random.default_rng(seed)
    gradient = rng.normal(size=(3, 3))
    gradient -= np.trace(gradient) / 3.0 * np.eye(3)
    return {
        "velocity": rng.normal(size=(2, 3)),
        "angular_velocity": rng.normal(size=(2, 3)),
        "flow": rng.normal(size=3),
        "gradient": gradient,
    }


CENTRES = np.array([[0.3, -0.2, 1.0], [1.1, 0.9, 0.4]])
RADII = (0.4, 0.9)


def test_loads_turn_with_the_scene():
    motion = random_motion(1)
    found = loads_on_two_spheres(CENTRES, **motion, radii=RADII)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    turned = loads_on_two_spheres(
        CENTRES @ turn.T,
        motion["velocity"] @ turn.T,
        motion["angular_velocity"] @ turn.T,
        turn @ motion["flow"],
        turn @ motion["gradient"] @ turn.T,
        RADII,
    )
    np.testing.assert_allclose(turned.force, found.force @ turn.T, atol=1e-11)
    np.testing.assert_allclose(turned.torque, found.torque @ turn.T, atol=1e-11)
    np.testing.assert_allclose(turned.stresslet, turn @ found.stresslet @ turn.T, atol=1e-11)


def test_the_order_of_the_spheres_does_not_matter():
    motion = random_motion(2)
    found = loads_on_two_spheres(CENTRES, **motion, radii=RADII)
    for name in ("velocity", "angular_velocity"):
        motion[name] = motion[name][::-1]
    swapped = loads_on_two_spheres(CENTRES[::-1], **motion, radii=RADII[::-1])
    for name, load in vars(swapped).items():
        np.testing.assert_allclose(load[::-1], getattr(found, name), atol=1e-11)


def test_spheres_that_move_with_a_rigid_flow_feel_nothing():
    spin, flow = np.array([0.3, -1.0, 0.7]), np.array([1.0, 2.0, -0.5])
    gradient = np.cross(spin, np.eye(3)).T
    motion = flow + CENTRES @ gradient.T, np.tile(spin, (2, 1))
    for load in vars(loads_on_two_spheres(CENTRES, *motion, flow, gradient, RADII)).values():
        np.testing.assert_allclose(load, 0.0, atol=1e-12)


def test_lone_spheres_feel_the_drag_torque_and_stresslet_of_stokes_and_einstein():
    """At a distance of 5,000 d_p what the other adds is of the order of 1e-4."""
    motion = random_motion(3) | {"flow": np.zeros(3)}
    centres = np.array([[0.0, 0.0, 0.0], [3e3, 4e3, 0.0]])
    strain = 0.5 * (motion["gradient"] + motion["gradient"].T)
    spin = motion["gradient"] - strain
    spin = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    motion["velocity"][1] += motion["gradient"] @ centres[1]
    found = loads_on_two_spheres(centres, **motion, radii=(0.5, 1.0))
    slip = motion["velocity"] - centres @ motion["gradient"].T
    np.testing.assert_allclose(found.force, -np.array([[1.0], [2.0]]) * slip, atol=2e-3)
    turning = motion["angular_velocity"] - spin
    np.testing.assert_allclose(found.torque, -np.array([[1.0], [8.0]]) * turning, atol=1e-5)
    for stresslet, size in zip(found.stresslet, (1.0, 8.0), strict=True):
        np.testing.assert_allclose(stresslet, 5.0 / 6.0 * size * strain, atol=1e-5)


@pytest.mark.parametrize("turns", [False, True])
def test_a_far_sphere_feels_the_flow_of_the_other_by_faxens_laws(turns):
    """The other as if alone: a Stokeslet and its source doublet, or a rotlet."""
    a, b, distance = 0.5, 1.2, 400.0
    line = np.array([2.0, 3.0, 6.0]) / 7.0
    motion = np.array([0.5, -1.0, 0.3])

    def flow(x):
        r = np.linalg.norm(x, axis=-1, keepdims=True)
        if turns:
            return (a / r) ** 3 * np.cross(motion, x)
        along = (x @ motion)[..., None] * x / r**2
        stokeslet, doublet = 0.75 * a / r, 0.25 * (a / r) ** 3
        return stokeslet * (motion + along) + doublet * (motion - 3.0 * along)

    # Derivatives by central differences about the far sphere, their step a few of its radii.
    place, step = distance * line, 1.0
    ends = flow(place + step * np.stack([np.eye(3), -np.eye(3)]))
    gradient = (ends[0] - ends[1]).T / (2.0 * step)
    laplacian = (ends.sum(axis=(0, 1)) - 6.0 * flow(place[None])[0]) / step**2
    strain = 0.5 * (gradient + gradient.T)
    curl = np.array([gradient[k - 1, k - 2] - gradient[k - 2, k - 1] for k in range(3)])

    still, moves = np.zeros((2, 3)), np.stack([motion, np.zeros(3)])
    velocity, turning = (still, moves) if turns else (moves, still)
    found = loads_on_two_spheres([np.zeros(3), place], velocity, turning, radii=(a, b))
    force = 2.0 * b * (flow(place[None])[0] + b**2 / 6.0 * laplacian)
    for load, known in (
        (found.force[1], force),
        (found.torque[1], 8.0 * b**3 * 0.5 * curl),
        (found.stresslet[1], 20.0 / 3.0 * b**3 * strain),
    ):
        np.testing.assert_allclose(load, known, atol=3e-4 * np.abs(known).max())


@pytest.mark.parametrize(
    ("gap", "radii", "message"),
    [
        (0.0, (0.5, 0.5), "gap 0 d_p: allowed are"),
        (-0.1, (0.5, 0.5), "gap -0.1 d_p: allowed are"),
        (np.nan, (0.5, 0.5), "allowed are"),
        (1e-7, (0.5, 0.5), "here 5e-07 to 5000"),
        (1.0, (0.5, -0.5), "radius of sphere 1 is -0.5"),
        (1.0, (0.5, np.inf), "radius of sphere 1 is inf"),
        (1.0, (0.5,), "radii must have the shape"),
        (1.0, (0.5, 60.0), "ratio may be 100 at most"),
        (1e-6, (0.5, 50.0), "degrees are needed, at most 60000 are allowed"),
    ],
)
def test_pairs_that_mean_nothing_are_refused(gap, radii, message):
    with pytest.raises(ValueError, match=message):
        pair_resistance(gap, radii)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"velocity": np.zeros(3)}, r"velocity must have the shape \(2, 3\)"),
        ({"gradient": np.eye(3)}, "trace"),
        ({"angular_velocity": np.full((2, 3), np.nan)}, "angular_velocity of sphere 0"),
        ({"flow": [0.0, 1.0]}, "three finite numbers"),
    ],
)
def test_motions_that_mean_nothing_are_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        loads_on_two_spheres(CENTRES, **(random_motion(4) | changed), radii=RADII)

"""Three spheres that settle as others have published it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dustfall.stokes import Status, mobility
from tests.stokes.clusters import triangle

WILSON = {
    2.1: (0.73857, 0.59718, 0.03517, 0.052035),
    2.5: (0.87765, 0.49545, 0.07393, 0.045466),
    3.0: (0.93905, 0.41694, 0.07824, 0.035022),
    4.0: (0.97964, 0.31859, 0.06925, 0.021634),
    6.0: (0.99581, 0.21586, 0.05078, 0.010159),
}
"""Equilateral triangle of side s radii, a force on one sphere towards the middle of the others.

Velocity of that sphere and of the others along the force, velocity and angular velocity [over the
radius] of the others as they part; by Lamb's solution and reflections (Wilson 2013, J. Comput.
Phys. 245, 302-316, as the tests of MuNDy quote its table). At its s = 2.01, 0.65528, 0.63461,
0.00498, this solver finds 0.65526, 0.63461, 0.00495.
"""


@pytest.mark.parametrize("s", WILSON)
def test_a_triangle_moves_as_wilson_found(s):
    centres = triangle(s)
    towards, apart = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    found = mobility(centres, np.outer([0.0, 0.0, 1.0], towards), tolerance=4e-6)
    velocity, turning = found.velocity, 0.5 * found.angular_velocity[:, 2]
    got = [velocity[2] @ towards, velocity[1] @ towards, velocity[1] @ apart, turning[1]]
    np.testing.assert_allclose(got, WILSON[s], rtol=0.0, atol=9e-6)
    np.testing.assert_allclose(velocity[0], [-1.0, 1.0, 1.0] * velocity[1], atol=1e-9)
    assert found.status == Status.CONVERGED


DURLOFSKY = np.array([
    [-4.85, -22.1], [-3.28, -76.9], [-2.71, -121.7], [-3.37, -177.4], [-4.27, -221.0],
    [-3.12, -278.0], [-1.18, -325.5], [-1.12, -374.8], [-0.84, -426.6], [2.66, -470.9],
    [5.33, -526.1], [5.91, -572.8], [0.00, -23.7], [0.32, -79.2], [1.36, -121.8], [3.83, -173.2],
    [6.58, -223.6], [7.04, -274.6], [4.59, -327.1], [2.40, -373.8], [2.47, -426.1], [6.21, -478.1],
    [5.82, -528.1], [4.03, -576.3], [6.57, -28.2], [4.38, -73.1], [2.02, -120.0], [0.31, -172.8],
    [0.45, -230.9], [1.20, -271.7], [1.66, -320.0], [2.64, -376.2], [5.40, -423.3], [9.25, -477.8],
    [9.23, -526.3], [8.39, -573.9],
])  # fmt: skip
"""Places [radii] on the paths of spheres that start at x = -5, 0 and 7 and settle along -z.

Durlofsky, Brady and Bossis 1987, J. Fluid Mech. 180, 21-49, figure 5, by Stokesian dynamics; read
off by Townsend (2024, J. Open Source Softw. 9, 6011): one of twenty of those points that lie above
z = -600. Below, every small difference grows (Janosi et al. 1997) and no two methods agree.
"""


def test_three_spheres_settle_along_published_paths():
    start = np.array([[-2.5, 0.0, 0.0], [0.0, 0.0, 0.0], [3.5, 0.0, 0.0]])
    weight = np.tile([0.0, 0.0, -1.0], (3, 1))

    def velocity(_, places):
        return mobility(places.reshape(3, 3), weight, tolerance=1e-3).velocity.ravel()

    times = np.linspace(0.0, 225.0, 2000)  # [d_p / U]
    paths = solve_ivp(velocity, times[[0, -1]], start.ravel(), t_eval=times, rtol=1e-5, atol=1e-5)
    x, y, z = 2.0 * paths.y.reshape(3, 3, -1).transpose(1, 0, 2)
    np.testing.assert_allclose(y, 0.0, atol=1e-9)
    # The figure is about as high as it is wide: 800 radii and 19.
    off = [np.hypot(x - place, (z - height) / 40.0).min() for place, height in DURLOFSKY]
    assert max(off) < 0.1

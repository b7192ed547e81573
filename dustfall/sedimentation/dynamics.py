"""Forces on settling particles and the step that moves them.

Units are those of an isolated sphere: length d_p, time tau, velocity v_s; gravity points along -z
and the fluid is at rest. Newton's law for one particle,

    m dv/dt = (m - m_f) g + 3 pi eta d |u_rel| R^T F' / 24,     u_rel = -v,

with F' the force in Re_p c_D in the frame where the flow runs along +y (paper, section "Integration
of the IDNN into the CFD framework"), divided by (m - m_f) g = 3 pi eta d v_s becomes

    dv/dt = -e_z + |v| R^T F' / 24,     dx/dt = (v_s tau / d) v,

since m / (3 pi eta d) = tau: buoyancy is inside v_s and the factor of gravity is one. The drag is
split into the part against the motion, -beta v with beta = F'_y / 24, and the rest, the side force.
"""

import numpy as np
from numba import njit

from dustfall.forces.frames import rotation_to_streamwise
from dustfall.units import STOKES_DRAG

UP = np.array([0.0, 0.0, 1.0])

SERIES_BELOW = 0.05
"""Where `beta * step` is smaller, the differences of exponentials come from their series."""


def drag_coefficients(model, velocity: np.ndarray, neighbours: np.ndarray, rows=None):
    """Ask a force model for the drag on every particle.

    A particle at rest has no direction of flow and no drag; its beta is that of the flow it meets
    once it falls, along +z.

    Parameters
    ----------
    model : has `predict(neighbours)`, (n, 5, 3) in d_p to (n, 3) in Re_p c_D, flow along +y
    velocity : (n, 3) in v_s, box frame
    neighbours : (n, 5, 3) from each particle to its neighbours in d_p, box frame
    rows : (n,) numbers of these particles, for the message of an error; by default 0 to n - 1

    Returns
    -------
    beta : (n,), drag against the motion over that of an isolated sphere, F'_y / 24
    side : (n, 3) in v_s / tau, box frame: the drag is `side - beta * velocity`

    Raises
    ------
    FloatingPointError : the model returned a force that is not finite.
    """
    at_rest = ~velocity.any(axis=1)
    flow = -velocity
    flow[at_rest] = UP
    rotation = rotation_to_streamwise(flow)
    force = np.ascontiguousarray(model.predict(_rotate(rotation, neighbours)), dtype=np.float64)
    if not np.isfinite(force).all():
        k = np.flatnonzero(~np.isfinite(force).all(axis=1))[0]
        particle = k if rows is None else rows[k]
        raise FloatingPointError(
            f"the force model returned {force[k]} for particle {particle}, which has velocity "
            f"{velocity[k]} and neighbours at {neighbours[k].tolist()}"
        )
    return force[:, 1] / STOKES_DRAG, _side_force(rotation, force, velocity)


@njit(cache=True, nogil=True)
def _rotate(rotation, neighbours):
    """R r for each neighbour of each particle."""
    rotated = np.empty_like(neighbours)
    for i in range(len(neighbours)):
        for j in range(neighbours.shape[1]):
            x, y, z = neighbours[i, j, 0], neighbours[i, j, 1], neighbours[i, j, 2]
            for axis in range(3):
                rotated[i, j, axis] = (
                    rotation[i, axis, 0] * x + rotation[i, axis, 1] * y + rotation[i, axis, 2] * z
                )
    return rotated


@njit(cache=True, nogil=True)
def _side_force(rotation, force, velocity):
    """|v| R^T (F'_x, 0, F'_z) / 24."""
    side = np.empty_like(velocity)
    for i in range(len(velocity)):
        speed = np.sqrt(velocity[i, 0] ** 2 + velocity[i, 1] ** 2 + velocity[i, 2] ** 2)
        scale = speed / STOKES_DRAG
        for axis in range(3):
            side[i, axis] = scale * (
                rotation[i, 0, axis] * force[i, 0] + rotation[i, 2, axis] * force[i, 2]
            )
    return side


@njit(cache=True, nogil=True)
def advance(position, velocity, beta, side, step, stokes_number):
    """Move all particles through one step in which beta and the side force do not change.

    Exact for such a step (exponential integrator, e.g. Hochbruck & Ostermann 2010):
    v' = v + h phi1(beta h) a and x' = x + St h (v + h phi2(beta h) a), where a is the acceleration
    at the start of the step, phi1(q) = (1 - exp(-q)) / q and phi2(q) = (1 - phi1(q)) / q.

    Parameters
    ----------
    position, velocity : (n, 3) in d_p and v_s
    beta, side : (n,) and (n, 3) as from `drag_coefficients`
    step : in tau
    stokes_number : v_s tau / d_p

    Returns
    -------
    position, velocity : (n, 3) at the end of the step
    """
    new_position = np.empty_like(position)
    new_velocity = np.empty_like(velocity)
    for i in range(len(position)):
        q = beta[i] * step
        if abs(q) < SERIES_BELOW:
            # The last term left out is below 1e-16 of the sum.
            phi2 = 1.0
            for k in range(10, 2, -1):
                phi2 = 1.0 - q / k * phi2
            phi2 *= 0.5
            phi1 = 1.0 - q * phi2
        else:
            phi1 = -np.expm1(-q) / q
            phi2 = (1.0 - phi1) / q
        for axis in range(3):
            v = velocity[i, axis]
            acceleration = side[i, axis] - beta[i] * v
            if axis == 2:
                acceleration -= 1.0
            new_velocity[i, axis] = v + step * phi1 * acceleration
            new_position[i, axis] = position[i, axis] + stokes_number * step * (
                v + step * phi2 * acceleration
            )
    return new_position, new_velocity

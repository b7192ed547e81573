"""The one-body operator: how a lone fixed sphere answers any incoming flow.

Every sphere is the same body: the single-layer matrix of a template mesh is assembled and factored
once, and the stress tests hold its answer against that of the same mesh turned. Seen by others a
sphere is described by few numbers: the incoming velocity enters through its surface harmonics
u_lm, the traction leaves through its moments q_lm = integral of f Y_lm dS. The answer of a sphere
commutes with rotations, so on each degree and total momentum (`harmonics`) it is a number: the
mesh's answer, averaged over all orientations of the mesh.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.single_layer import nodal_integrals, self_interaction
from dustfall.stokes.harmonics import axes_swapped, real_harmonics, total_momentum_projectors
from dustfall.units import RADIUS

RESPONSE_DEGREE = 10
"""Largest degree of the harmonics for which a template's answer is computed."""


@dataclass(frozen=True)
class OneBody:
    """A template mesh with its factored single-layer matrix and its answer to harmonics.

    mesh: the template. factor: lower Cholesky factor (3n, 3n) of the single-layer matrix, to
    which the outer product of the nodal normals is added: an incompressible flow never excites
    them, and without it the matrix would be singular (the net flux through a sphere is zero
    whatever the pressure inside). response: (RESPONSE_DEGREE + 1, 3), moments for unit incoming
    harmonics of degree n and total momentum J = n - 1, n, n + 1; lengths in radii, mu = 1. Zero
    where there is no such field, and for the normal (n = 1, J = 0), which no flow excites.
    """

    mesh: SphereMesh
    factor: np.ndarray
    response: np.ndarray

    @classmethod
    def from_mesh(cls, mesh: SphereMesh, **quadrature) -> "OneBody":
        """Assemble and factor; `quadrature` as in `single_layer.self_interaction`."""
        matrix = self_interaction(mesh, **quadrature)
        normals = nodal_integrals(mesh, lambda n: n).ravel()
        factor, _ = cho_factor(matrix + np.outer(normals, normals), lower=True)
        factor = np.tril(factor)
        moments = nodal_integrals(mesh, lambda n: real_harmonics(RESPONSE_DEGREE, n))
        spread = np.kron(moments, np.eye(3))
        answer = spread.T @ cho_solve((factor, True), spread) / RADIUS
        return cls(mesh, factor, _rotational_average(answer))

    def solve(self, load):
        """Nodal tractions (3n, ...) for the weighted incoming velocities <phi_a, u> (3n, ...)."""
        return cho_solve((self.factor, True), load, check_finite=False)

    def drag(self) -> float:
        """Force along a unit flow on a lone sphere [mu U d_p], exactly 3 pi on a perfect mesh."""
        return 4.0 * np.pi * RADIUS * float(self.response[0, 2])


def _rotational_average(answer) -> np.ndarray:
    """The mean over all rotations of an answer (3k, 3k), by Schur's lemma: traces on subspaces."""
    swap = axes_swapped(RESPONSE_DEGREE)
    response = np.zeros((RESPONSE_DEGREE + 1, 3))
    for n in range(RESPONSE_DEGREE + 1):
        own = slice(3 * n * n, 3 * (n + 1) ** 2)
        for total, projector in total_momentum_projectors(n, swap).items():
            response[n, total - n + 1] = np.sum(projector * answer[own, own]) / (2 * total + 1)
    response[1, 0] = 0.0
    return response

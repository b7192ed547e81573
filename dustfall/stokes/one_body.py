"""The one-body operator: how a lone fixed sphere answers any incoming flow.

Every sphere is the same body, so its single-layer matrix is factored once for a template mesh and
used for every sphere of every scene. Seen from afar a sphere is described by few numbers: the
incoming velocity enters through its surface harmonics u_lm, the traction leaves through its
moments q_lm = integral of f Y_lm dS, and the response q = T u is a small matrix.
"""

from dataclasses import dataclass

import h5py
import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dustfall.files import atomic
from dustfall.stokes.harmonics import real_harmonics
from dustfall.stokes.mesh import SphereMesh
from dustfall.stokes.single_layer import nodal_integrals, self_interaction

HARMONIC_DEGREE = 10
"""Largest degree of the harmonics through which a sphere answers in compressed form."""


@dataclass(frozen=True)
class OneBody:
    """A template mesh with its factored single-layer matrix and its compressed response.

    mesh: the template. factor: lower Cholesky factor (3n, 3n) of the single-layer matrix, to
    which the outer product of the nodal normals is added: an incompressible flow never excites
    them, and without it the matrix would be singular (the net flux through a sphere is zero
    whatever the pressure inside). moments: (n, (degree + 1)^2), moments = sum_a moments[a] f_a.
    response: (3k, 3k), k = (degree + 1)^2; row 3 lm + i is harmonic lm, direction i.
    """

    mesh: SphereMesh
    factor: np.ndarray
    moments: np.ndarray
    response: np.ndarray

    @classmethod
    def from_mesh(cls, mesh: SphereMesh, **quadrature) -> "OneBody":
        """Assemble and factor; `quadrature` as in `single_layer.self_interaction`."""
        matrix = self_interaction(mesh, **quadrature)
        normals = nodal_integrals(mesh, lambda n: n).ravel()
        factor, _ = cho_factor(matrix + np.outer(normals, normals), lower=True)
        factor = np.tril(factor)
        moments = nodal_integrals(mesh, lambda n: real_harmonics(HARMONIC_DEGREE, n))
        spread = np.kron(moments, np.eye(3))
        response = spread.T @ cho_solve((factor, True), spread)
        return cls(mesh, factor, moments, 0.5 * (response + response.T))

    def solve(self, load):
        """Nodal tractions (3n, ...) for the weighted incoming velocities <phi_a, u> (3n, ...)."""
        return cho_solve((self.factor, True), load, check_finite=False)

    def drag(self) -> float:
        """Force along a unit flow on a lone sphere [mu U d_p], exactly 3 pi on a perfect mesh."""
        return 4.0 * np.pi * float(self.response[1, 1])

    def save(self, path) -> None:
        """Write the mesh and its operator to an HDF5 file."""
        with atomic(path) as temporary, h5py.File(temporary, "w") as file:
            file.attrs["content"] = "one-body operator; lengths in d_p, mu = 1, traction along flow"
            file["vertices"] = self.mesh.vertices
            file["triangles"] = self.mesh.triangles
            file["factor"] = self.factor
            file["moments"] = self.moments
            file["response"] = self.response

    @classmethod
    def load(cls, path) -> "OneBody":
        """Read what `save` wrote."""
        with h5py.File(path) as file:
            mesh = SphereMesh(file["vertices"][:], file["triangles"][:])
            return cls(mesh, *(file[name][:] for name in ("factor", "moments", "response")))

"""The discretisation ladder: fixed spheres in free space, every pair integrated in full.

A scheme turns a mesh of the sphere into a discretised body. A body holds
- `unknowns`, the number of its traction nodes;
- `self_matrix()` (3u, 3u), the velocity that its own traction induces, one row a test function;
- `matrix_from(source, shift)` (3u, 3u'), the same by another body; shift = own centre - its centre;
- `test_weights` (u,): what a uniform unit velocity gives in each equation;
- `test_normals`, `trial_normals` (u, 3): the normal as seen by test functions and by unknowns;
- `forces` (u,): the force by a unit of each unknown.
mu = 1, lengths in d_p. The bodies meet in `solve_blocks`, preconditioned by the one-body operator.
"""

from functools import lru_cache, partial

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse import csr_array, kron
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall.spheres import checked_centres, checked_flow
from dustfall.stokes.elements import single_layer
from dustfall.stokes.elements.collocation import elements_of
from dustfall.stokes.elements.collocation import single_layer as collocate_single_layer
from dustfall.stokes.elements.element_pairs import coupling, side
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.units import FORCE_UNIT, RADIUS

MOST_ITERATIONS = 300


class ConstantCollocation:
    """Constant traction on each element, the equation held at each centroid.

    The unknown is traction times radius, so that the size of the sphere leaves the equations.
    """

    symmetric = False

    def __init__(self, mesh: SphereMesh, tolerance: float, flat: bool):
        self.elements = elements_of(mesh, flat, tolerance)
        self.unknowns = len(self.elements.area)
        self.test_weights = np.ones(self.unknowns)
        self.test_normals = self.elements.normal
        self.trial_normals = self.elements.vector_area
        self.forces = RADIUS * self.elements.area

    def self_matrix(self) -> np.ndarray:
        return collocate_single_layer(self.elements.centre, True, self.elements)

    def matrix_from(self, source: "ConstantCollocation", shift) -> np.ndarray:
        targets = self.elements.centre + shift / RADIUS
        return collocate_single_layer(targets, False, source.elements)


class QuadraticGalerkin:
    """Continuous piecewise quadratic traction and test functions on projected elements."""

    symmetric = True

    def __init__(self, mesh: SphereMesh, tolerance: float):
        self.mesh = mesh
        self.tolerance = tolerance
        self.test_normals = single_layer.nodal_integrals(mesh, lambda n: n)
        self.trial_normals = self.test_normals
        self.forces = single_layer.nodal_integrals(mesh, lambda n: np.ones(len(n)))[:, 0]
        self.test_weights = self.forces
        self.unknowns = len(self.forces)

    def self_matrix(self) -> np.ndarray:
        return _quadratic_self_matrix(self.mesh)

    def matrix_from(self, source: "QuadraticGalerkin", shift) -> np.ndarray:
        return coupling(side(self.mesh, self.tolerance), side(source.mesh, self.tolerance), shift)


@lru_cache(maxsize=1)
def _quadratic_self_matrix(mesh):
    """Kept because the linear scheme on the same mesh wants it too."""
    return single_layer.self_interaction(mesh)


class LinearGalerkin:
    """Continuous piecewise linear traction, as the part of the quadratic space that it is."""

    symmetric = True

    def __init__(self, mesh: SphereMesh, tolerance: float):
        self.quadratic = QuadraticGalerkin(mesh, tolerance)
        ends = np.eye(len(mesh.vertices))
        # On the middle of an edge a linear function is the mean of its values at both ends.
        embedding = np.concatenate([ends, ends[mesh.edges].mean(axis=1)])
        self.embedding = kron(csr_array(embedding), np.eye(3), format="csr")
        self.test_normals = embedding.T @ self.quadratic.test_normals
        self.trial_normals = self.test_normals
        self.forces = embedding.T @ self.quadratic.forces
        self.test_weights = self.forces
        self.unknowns = len(self.forces)

    def self_matrix(self) -> np.ndarray:
        return self.embedding.T @ self.quadratic.self_matrix() @ self.embedding

    def matrix_from(self, source: "LinearGalerkin", shift) -> np.ndarray:
        quadratic = self.quadratic.matrix_from(source.quadratic, shift)
        return self.embedding.T @ quadratic @ source.embedding


SCHEMES = {
    "constant, flat elements": partial(ConstantCollocation, flat=True),
    "constant, projected elements": partial(ConstantCollocation, flat=False),
    "linear Galerkin, projected elements": LinearGalerkin,
    "quadratic Galerkin, projected elements": QuadraticGalerkin,
}
"""The rungs of the ladder; the first is the discretisation of the paper."""


def forces_by_elements(
    centres, mesh, scheme: str, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-6
) -> np.ndarray:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow, by boundary elements.

    centres: (n, 3) [d_p]. mesh: one SphereMesh for all spheres, or one for each. scheme: a key of
    SCHEMES. flow: (3,), its magnitude makes forces dimensionless. tolerance: relative error of the
    quadrature and residual of GMRES; what the mesh is worth is not its business.
    Returns (n, 3) in Re_p c_D, 24 along the flow for one sphere on a perfect mesh.
    Raises ValueError for wrong shapes, overlaps or an unknown scheme, RuntimeError if GMRES fails.
    """
    centres, flow = checked_centres(centres), checked_flow(flow)
    if scheme not in SCHEMES:
        raise ValueError(f"scheme {scheme!r}: allowed are {', '.join(map(repr, SCHEMES))}")
    meshes = [mesh] * len(centres) if isinstance(mesh, SphereMesh) else list(mesh)
    if len(meshes) != len(centres):
        raise ValueError(f"{len(meshes)} meshes for {len(centres)} spheres: give one, or one each")
    speed = np.linalg.norm(flow)
    if speed == 0.0:
        return np.zeros_like(centres)

    bodies, operators = zip(*[_discretised(m, scheme, tolerance) for m in meshes], strict=True)
    solution = solve_blocks(
        operators,
        _pair_blocks(bodies, centres),
        [np.outer(body.test_weights, flow / speed).ravel() for body in bodies],
        tolerance,
    )
    force = [body.forces @ f.reshape(-1, 3) for body, f in zip(bodies, solution, strict=True)]
    return FORCE_UNIT * np.array(force)


@lru_cache(maxsize=4)
def _discretised(mesh, scheme, tolerance):
    """A body and its one-body operator: the same for every sphere of every scene on this mesh."""
    body = SCHEMES[scheme](mesh, tolerance)
    return body, one_body_operator(body)


def one_body_operator(body):
    """LU factors of a body's own matrix.

    The pressure inside a closed surface exerts no net flow, so the matrix says nothing about a
    traction along the normal: the outer product of the normals fixes it, and no force changes.
    """
    gauge = np.outer(body.test_normals.ravel(), body.trial_normals.ravel())
    return lu_factor(body.self_matrix() + gauge, overwrite_a=True, check_finite=False)


def _pair_blocks(bodies, centres) -> dict:
    """The matrix of every ordered pair of bodies."""
    blocks: dict[tuple[int, int], np.ndarray] = {}
    for i, target in enumerate(bodies):
        for j, source in enumerate(bodies):
            if i != j and (j, i) in blocks and target.symmetric:
                blocks[i, j] = blocks[j, i].T
            elif i != j:
                blocks[i, j] = target.matrix_from(source, centres[i] - centres[j])
    return blocks


def solve_blocks(operators, blocks, right, tolerance) -> list[np.ndarray]:
    """Solve sum_j A_ij f_j = b_i by GMRES, preconditioned by the factored diagonal blocks.

    operators: LU factors of A_ii. blocks: A_ij by (i, j). right: b_i. Returns the f_i.
    """
    ends = np.cumsum([len(b) for b in right])[:-1]

    def answer(loads):
        return np.concatenate(
            [lu_solve(lu, b, check_finite=False) for lu, b in zip(operators, loads, strict=True)]
        )

    def left(unknowns):
        own = np.split(unknowns, ends)
        loads = [np.zeros(len(b)) for b in right]
        for (i, j), block in blocks.items():
            loads[i] += block @ own[j]
        return unknowns + answer(loads)

    start = answer(right)
    if not blocks:
        return np.split(start, ends)
    operator = LinearOperator((len(start), len(start)), matvec=left, dtype=float)
    solution, failed = gmres(operator, start, rtol=tolerance, restart=MOST_ITERATIONS, maxiter=1)
    if failed:
        raise RuntimeError(f"GMRES did not reach {tolerance:.1e} in {MOST_ITERATIONS} iterations")
    return np.split(solution, ends)

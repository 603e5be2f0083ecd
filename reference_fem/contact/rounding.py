"""How far a round tip stands out of the flat facets that mesh it."""

import numpy as np

from meshes import FingerMesh
from reference_fem.arrays import Array, Index

# Distance of nodes from a sphere or cylinder over its radius at which they count as lying on it:
# mesh files hold single precision at worst.
ON_IT = 1e-6


def sphere(points: Array) -> tuple[Array, float] | None:
    """Centre (dim,) and radius of the sphere that all points (n, dim) lie on; None: there is none.

    Least squares of |x|² = 2 c·x + (R² - |c|²), which is linear in c and R² - |c|².
    """
    dim = points.shape[1]
    if len(points) < dim + 2:  # there always is one
        return None
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    x = (points - middle) / size
    matrix = np.column_stack([2.0 * x, np.ones(len(x))])
    found, _, rank, _ = np.linalg.lstsq(matrix, (x * x).sum(axis=1), rcond=1e-9)
    if rank <= dim:  # in one plane
        return None
    radius = float(np.sqrt(found[-1] + found[:-1] @ found[:-1]))
    if np.abs(np.linalg.norm(x - found[:-1], axis=1) - radius).max() > ON_IT * radius:
        return None
    return middle + size * found[:-1], size * radius


def standing_out(mesh: FingerMesh, facets: Index, shape: Array) -> Array:
    """Distance from points of the facets to the tip's true surface, (n_facets, q), m.

    With the centre c and the radius R of the sphere through the nodes of the facet set ``tip``
    (of the mesh's shape where some nodes hang or stand out),

        R - |x_q - c|               on facets whose nodes lie on the sphere,
        R - |x_q - c - e (x_q-c)·e|     on those whose nodes lie on the cylinder about e = X that
                                    the sphere ends in

    and zero on all others, and where the tip is not a sphere.

    shape : (q, n), N_i at the points.
    """
    tip = mesh.points[np.unique(mesh.facet_sets.get("tip", np.empty(0, dtype=np.int64)))]
    ball = sphere(tip)
    body = mesh.shape
    if body is not None and body.tip == "hemisphere" and (mesh.ties.size or ball is None):
        radius = body.radii[-1]  # nodes that hang or stand out lie on no sphere
        ball = np.eye(mesh.dim)[0] * (body.end + radius), radius
    out = np.zeros((len(facets), len(shape)))
    if ball is None:
        return out
    centre, radius = ball
    arm = mesh.points - centre
    inside = np.einsum("qa,fad->fqd", shape, arm[facets])
    for first in (1, 0):  # the cylinder, then the sphere, which prevails where both hold
        lies = np.abs(np.linalg.norm(arm[:, first:], axis=1) - radius) <= ON_IT * radius
        on = lies[facets].all(axis=1)
        out[on] = radius - np.linalg.norm(inside[on][..., first:], axis=2)
    return out

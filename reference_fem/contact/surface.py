"""Penalty contact integrated over the surface: a pressure law, whatever the mesh.

A stiff penalty with Coulomb friction and without any damping flutters: normal and tangential
motion of the surface's nodes couple through the friction force, which makes the stiffness
unsymmetric, and waves as short as the elements grow (in the continuum at any wave length: Martins,
Guimarães, Faria 1995, J. Vib. Acoust. 117; Ranjith, Rice 2001, J. Mech. Phys. Solids 49). On the
hard finger with κ of factor 300 it raised the peak force by 7 %. Dashpots of a tenth of the body's
impedance stop it there, three times as much changes the peak by 0.05 % (their time constant c/κ is
some nanoseconds). On two of four meshes of the soft finger, which differ only in the patch's place
in its cell, they leave 1.3 and 2.2 %; a relaxation time of a tenth of a bar wave's time along an
edge leaves 0.02 %.
"""

import numpy as np

from meshes import FingerMesh
from reference_fem.arrays import Array, Index
from reference_fem.contact.springs import SpringContact, Springs
from reference_fem.elements.facet_quadrature import FacetQuadrature

# Distance of nodes from a sphere or cylinder over its radius at which they count as lying on it:
# mesh files hold single precision at worst.
ON_IT = 1e-6


def surface_contact(
    quadrature: FacetQuadrature, out: Array, modulus: float, viscosity: float
) -> SpringContact:
    """The law p = max(0, -κ g - c g') at quadrature points of the facets below the surface.

    A point has a spring κ w and a dashpot c w, w its reference area. How far the true surface
    stands out of the facets is taken along the plane's normal, from which that of a patch of radius
    a differs by a/R: an error of s (a/R)²/2. Without it a patch grows by whole facets: on a sphere
    it scatters the peak by up to 1 %.

    out : (n_facets, q), s, m; see `standing_out`. modulus, viscosity : κ, Pa/m, and c, Pa s/m.

    The contact stiffness Σ_q κ w_q N_q N_qᵀ is not diagonal, but as N >= 0 and Σ_i N_i = 1,
    (N_q·x)² <= Σ_i N_qi x_i²: the diagonal of the row sums bounds it (Jensen).
    """
    nodes, area = quadrature.nodal_area()
    facets, shape, weight = quadrature
    springs = Springs(facets, shape, weight, out, modulus * weight, viscosity * weight)
    return SpringContact(nodes, area, modulus * area, viscosity * area, springs)


def contact_modulus(factor: float, plane_modulus: float, radius: float) -> float:
    """κ = f E*/R, Pa/m, E* = E/(1 - ν²) that of the tip on a rigid plane.

    It depends on body and factor alone. Under a Hertz patch of radius a the mean pressure
    4 E* a/(3π R) sinks in by a share 4R/(3π a f) of Hertz's approach a²/R: with a = R/11, as in
    the paper's soft finger, f = 1000 adds 0.5 % to the compliance, half the patch twice that.
    """
    return factor * plane_modulus / radius


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

"""Compliance of a tip between a beam that ends at its sphere's centre C and Hertz's half-space.

A traction p ~ sqrt(1 - r^2/b^2) of a unit force acts on a patch of radius b around the contact
point, along the normal n into the body or along the plane. Its mean displacement, weighted by the
traction, relative to a section about R behind C, less the parts of

    half-space:  0.6/(E* b) normal, 0.15 (2 - nu)/(G b) tangential (Johnson 1985, chapter 3),
    beam:        Timoshenko's cantilever from that section to C, rigid from there on,

is the compliance c/(E R) of the tip itself, extrapolated to b^2 -> 0 from two patches. n points up
and t away from the hinges, so that a phalanx that points along -X has t = -X.
"""

from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.arrays import Array
from reference_fem.elements.facet_quadrature import facet_quadrature
from reference_fem.settings import Material
from reference_fem.statics.tip import (
    displacements,
    last_phalanx,
    rigid_motion,
    section_at,
    touch_frame,
)

PATCHES = (0.25, 0.35)  # b/R


@dataclass(frozen=True)
class TipYield:
    """Compliance of a tip at its touch, times E R.

    nn, nt, tt : along the normal, of one direction by a force in the other, and along the plane
    """

    nn: float
    nt: float
    tt: float


def tip_yield(mesh: meshes.FingerMesh, material: Material, angle: float) -> TipYield:
    """The tip's own compliance.

    mesh, angle : as for `tip.tip_compliance`; the mesh is fine over `PATCHES`.
    """
    _, body = last_phalanx(mesh)
    points, symmetry = body.points, body.node_sets["symmetry"]
    radius, centre, contact, frame = touch_frame(body, angle)
    directions = frame[:2]
    facets = body.facet_sets["surface"]
    quadrature = facet_quadrature(points, facets)
    at = np.einsum("qk,fkd->fqd", quadrature.shape, points[facets])
    distance2 = ((at - contact) ** 2).sum(axis=2)
    force = np.zeros((len(points), 3, len(PATCHES), 2))
    means = np.zeros((len(PATCHES), len(points)))
    for patch, share in enumerate(PATCHES):
        # chords, not arcs: they equal r in the plane to second order in r/R
        traction = np.sqrt(np.maximum(1.0 - distance2 / (share * radius) ** 2, 0.0))
        nodal = (quadrature.weight * traction) @ quadrature.shape
        np.add.at(means[patch], facets, nodal)
        means[patch] /= means[patch].sum()
        force[:, :, patch] = np.einsum("i,bd->idb", means[patch], directions)
    symmetry_factor = 2 if symmetry.size else 1
    force = force.reshape(3 * len(points), len(PATCHES), 2) / symmetry_factor
    moved = displacements(body, material, force)
    section = section_at(points, centre[0] + radius)
    behind = float(points[section, 0].mean() - centre[0])
    c = np.einsum("pi,idpb,ad->pab", means, moved, directions)
    for patch in range(len(PATCHES)):
        for b in range(2):
            rigid = rigid_motion(body, section, moved[..., patch, b], contact)
            c[patch, :, b] -= directions @ rigid
        c[patch] -= half_space(material, PATCHES[patch] * radius)
        c[patch] -= beam(material, radius, angle, behind)
    squares = np.square(PATCHES)
    c = c[0] + (c[0] - c[1]) * squares[0] / (squares[1] - squares[0])
    c *= material.youngs_modulus * radius
    return TipYield(nn=float(c[0, 0]), nt=-0.5 * float(c[0, 1] + c[1, 0]), tt=float(c[1, 1]))


def half_space(material: Material, patch: float) -> Array:
    """Compliance (2, 2) of the half-space under the same tractions, m/N."""
    nu = material.poisson_ratio
    shear = 0.5 * material.youngs_modulus / (1 + nu)
    return np.diag(
        [0.6 / (material.plane_strain_modulus * patch), 0.15 * (2 - nu) / (shear * patch)]
    )


def beam(material: Material, radius: float, angle: float, s: float) -> Array:
    """Compliance (2, 2) of the contact point, rigid on the end C of a cantilever of length s, m/N.

    u = N s/(E A), v = Q (s^3/(3 E I) + s/(kappa G A)) + M s^2/(2 E I) and
    theta = Q s^2/(2 E I) + M s/(E I), M the moment of the force about C.
    """
    e, nu = material.youngs_modulus, material.poisson_ratio
    area, bending = np.pi * radius**2, e * np.pi * radius**4 / 4
    kappa = 6 * (1 + nu) ** 2 / (7 + 12 * nu + 4 * nu**2)
    # along the axis, towards the tip, and a quarter turn counter-clockwise from there
    outward = np.array([np.cos(angle), np.sin(angle)])
    directions = np.array([-outward, [-outward[1], outward[0]]])
    columns = []
    for axial, across in directions:
        moment = radius * (outward[0] * across - outward[1] * axial)
        v = across * (s**3 / (3 * bending) + 2 * (1 + nu) * s / (kappa * e * area))
        v += moment * s**2 / (2 * bending)
        turn = across * s**2 / (2 * bending) + moment * s / bending
        moved = np.array([axial * s / (e * area), v])
        columns.append(directions @ (moved + turn * radius * directions[1]))
    return np.array(columns).T

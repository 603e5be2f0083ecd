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

from dataclasses import dataclass

import numpy as np

from reference_fem.arrays import Array, Index
from reference_fem.compiled import njit
from reference_fem.contact import law
from reference_fem.contact.facet_quadrature import FacetQuadrature
from reference_fem.contact.friction import drag, first_touch
from reference_fem.contact.law import ContactLaw, Memory, Motion


@dataclass(frozen=True)
class SurfaceContact(ContactLaw):
    """p = max(0, -κ g - c g') at quadrature points of the facets below the surface.

    quadrature : facets, shape functions and weights
    out : (n_facets, q), how far the body's true surface stands out of the facets (see `rounding`),
        m
    modulus : κ, Pa/m
    viscosity : c, Pa s/m
    """

    quadrature: FacetQuadrature
    out: Array
    modulus: float
    viscosity: float

    @property
    def damping(self) -> Array:
        """Σ c w N_i (k,), N s/m."""
        return self.viscosity * self.area

    @property
    def sites(self) -> int:
        """One entry of history per quadrature point."""
        return self.quadrature.weight.size

    def touching_points(self, position: Array) -> Array:
        """The quadrature points, each lowered to the true surface."""
        facets = np.searchsorted(self.nodes, self.quadrature.facets)
        points = np.einsum("qa,fad->fqd", self.quadrature.shape, position[facets])
        points[..., 1] -= self.out
        return points.reshape(-1, position.shape[1])

    def apply(self, motion: Motion, memory: Memory, residual: Array, row: Array) -> None:
        """See `surface_forces`."""
        surface_forces(
            motion,
            memory,
            self.quadrature.facets,
            self.quadrature.shape,
            self.quadrature.weight,
            self.out,
            self.modulus,
            self.viscosity,
            residual,
            row,
        )


def surface_contact(
    quadrature: FacetQuadrature, out: Array, modulus: float, viscosity: float
) -> SurfaceContact:
    """Law of modulus κ (Pa/m) and viscosity c (Pa s/m) on the facets, `out` short of their surface.

    The contact stiffness Σ_q κ w_q N_q N_qᵀ is not diagonal, but as N >= 0 and Σ_i N_i = 1,
    (N_q·x)² <= Σ_i N_qi x_i²: the diagonal of the row sums bounds it (Jensen).
    """
    nodes, area = quadrature.nodal_area()
    return SurfaceContact(nodes, area, modulus * area, quadrature, out, modulus, viscosity)


def contact_modulus(factor: float, plane_modulus: float, radius: float) -> float:
    """κ = f E*/R, Pa/m, E* = E/(1 - ν²) that of the tip on a rigid plane.

    It depends on body and factor alone. Under a Hertz patch of radius a the mean pressure
    4 E* a/(3π R) sinks in by a share 4R/(3π a f) of Hertz's approach a²/R: with a = R/11, as in
    the paper's soft finger, f = 1000 adds 0.5 % to the compliance, half the patch twice that.
    """
    return factor * plane_modulus / radius


@njit(cache=True)
def surface_forces(
    motion: Motion,
    memory: Memory,
    facets: Index,
    shape: Array,
    weight: Array,
    out: Array,
    modulus: float,
    viscosity: float,
    residual: Array,
    row: Array,
) -> None:
    """Subtract the contact forces of all facets and commit the friction history.

        x_q = Σ_i N_i(q) (X_i + u_i),   g_q = y_q - s_q + H
        p_q = max(0, -κ g_q - c g_q')  where g_q < 0
        f_i = Σ_q w_q N_i(q) (p_q e_y + τ_q)

    τ_q by return mapping with the same κ, one anchor per point (see `friction`); an anchor starts
    where the point crossed the surface. w_q are reference areas.

    s_q is how far the true surface stands out of the facet (`rounding`). Its normal is taken as
    the plane's, from which that of a patch of radius a differs by a/R: an error of s (a/R)²/2.
    Without it a patch grows by whole facets: on a sphere it scatters the peak by up to 1 %.
    A bilinear facet lies between its nodes, so one with all nodes higher above the surface than
    any point stands out is passed over.

    motion, memory : see `law`; one site per point, tangential forces are tractions times w_q, N.
    facets : (n_facets, n). shape : (q, n). weight : (n_facets, q), m². out : (n_facets, q), s, m.
    modulus, viscosity : κ, Pa/m, and c, Pa s/m. residual : (n_points, dim). row : (COLUMNS,).
    """
    points, displacement, velocity = motion.points, motion.displacement, motion.velocity
    height, friction, step = motion.height, motion.friction, motion.step
    touching = memory.touching
    planar = points.shape[1] == 2
    n_q, n = shape.shape
    row[:] = 0.0
    lowest, reach = np.inf, out.max()
    for f in range(facets.shape[0]):
        low = np.inf
        for a in range(n):
            i = facets[f, a]
            low = min(low, points[i, 1] + displacement[i, 1] + height)
        if low >= reach:
            lowest = min(lowest, low)
            held = False
            for q in range(n_q):
                held = held or touching[f * n_q + q]
            if not held:
                continue
        for q in range(n_q):
            j = f * n_q + q
            gap, x, z = height - out[f, q], 0.0, 0.0
            for a in range(n):
                i = facets[f, a]
                gap += shape[q, a] * (points[i, 1] + displacement[i, 1])
                x += shape[q, a] * (points[i, 0] + displacement[i, 0])
                if not planar:
                    z += shape[q, a] * (points[i, 2] + displacement[i, 2])
            lowest = min(lowest, gap)
            if gap >= 0.0 and not touching[j]:
                continue
            v_x, v_y, v_z = 0.0, 0.0, 0.0
            for a in range(n):
                i = facets[f, a]
                v_x += shape[q, a] * velocity[i, 0]
                v_y += shape[q, a] * velocity[i, 1]
                if not planar:
                    v_z += shape[q, a] * velocity[i, 2]
            if not touching[j]:
                first_touch(memory, j, gap, x, z, v_x, v_y, v_z)
            k = modulus * weight[f, q]
            spring = max(0.0, -k * gap)
            normal = max(0.0, spring - viscosity * weight[f, q] * v_y) if spring > 0.0 else 0.0
            force_x, force_z, loss = drag(memory, j, k, x, z, friction * normal)
            row[law.DISSIPATION] += loss
            touching[j] = gap < 0.0
            if gap >= 0.0:
                continue
            for a in range(n):
                i = facets[f, a]
                residual[i, 0] -= shape[q, a] * force_x
                residual[i, 1] -= shape[q, a] * normal
                if not planar:
                    residual[i, 2] -= shape[q, a] * force_z
            size = np.sqrt(force_x * force_x + force_z * force_z)
            row[law.NORMAL] += normal
            row[law.TANGENTIAL] += force_x
            row[law.AREA] += weight[f, q]
            row[law.EXCESS] = max(row[law.EXCESS], size - friction * normal)
            row[law.SPRING_ENERGY] += 0.5 * (spring * spring + size * size) / k
            row[law.DAMPING] -= (normal - spring) * v_y * step
    row[law.GAP] = lowest

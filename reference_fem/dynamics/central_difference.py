"""Explicit central differences (leapfrog): one fused update of all nodes."""

from numba import prange

from reference_fem.arrays import Array
from reference_fem.compiled import njit


@njit(cache=True, parallel=True)
def leapfrog(
    displacement: Array,
    velocity: Array,
    residual: Array,
    inverse_mass: Array,
    gravity_vector: tuple[float, float],
    step: float,
) -> None:
    """Leapfrog step of all nodes, on numba's current number of threads.

        a = -M⁻¹ r + f,   v(t + Δt/2) = v(t - Δt/2) + Δt a,   u(t + Δt) = u + Δt v(t + Δt/2)

    Second order, explicit, symplectic; stable for Δt < 2/ω_max (Belytschko, Liu, Moran,
    Nonlinear Finite Elements, 2000, box 6.1, without its damping).

    displacement, velocity : (n_points, dim), updated in place. inverse_mass : (n_points,).
    residual : (n_points, dim), r: internal minus external force without gravity, N.
    gravity_vector, step : f, acceleration of gravity in the plane of motion, m/s²; Δt, s.
    """
    solid = displacement.shape[1] == 3
    drop_x, drop_y = step * gravity_vector[0], step * gravity_vector[1]
    for i in prange(len(displacement)):
        scale = step * inverse_mass[i]
        v_x = velocity[i, 0] - scale * residual[i, 0] + drop_x
        v_y = velocity[i, 1] - scale * residual[i, 1] + drop_y
        velocity[i, 0], velocity[i, 1] = v_x, v_y
        displacement[i, 0] += step * v_x
        displacement[i, 1] += step * v_y
        if solid:
            v_z = velocity[i, 2] - scale * residual[i, 2]
            velocity[i, 2] = v_z
            displacement[i, 2] += step * v_z

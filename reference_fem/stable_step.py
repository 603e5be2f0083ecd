"""The largest stable step of the explicit loop, contact penalty included."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stable_step(element_frequency: float, contact_stiffness: Array, contact_mass: Array) -> float:
    """Δt = 2/ω_max with ω_max² <= ω_e² + max_i k_i/m_i.

    For symmetric K and K_c, λ_max(M⁻¹(K + K_c)) <= λ_max(M⁻¹K) + λ_max(M⁻¹K_c). The first term
    is at most the largest element eigenvalue (Irons 1971; Fried 1972); K_c is diagonal with k_i
    in each direction of node i (a sticking node; a slipping one has fewer springs). Hinges and
    the symmetry plane only constrain the motion and can't raise ω_max (Rayleigh).

    Parameters
    ----------
    element_frequency
        ω_e, rad/s: the element kernel's bound.
    contact_stiffness, contact_mass : (k,)
        k_i, N/m, and lumped mass m_i, kg, of the nodes that may touch.

    Raises
    ------
    ValueError
        If the bound is not a positive finite number.
    """
    contact = float(np.max(contact_stiffness / contact_mass, initial=0.0))
    square = element_frequency**2 + contact
    if not (math.isfinite(square) and square > 0.0):
        raise ValueError(
            f"highest frequency = {math.sqrt(abs(square))} rad/s: no stable step exists; check "
            "the mesh for empty elements and the material for wrong units"
        )
    return 2.0 / math.sqrt(square)

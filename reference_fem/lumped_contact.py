"""The lumped contact law on a solid's end face: bilinear normal element, stick or slip.

The same law as the reduced model's (paper, section 2.2.2), written on its own as a return mapping
that is evaluated once per explicit step, without located events. The end face touches as one
point, with the mass-weighted mean of its nodes:

    x_C = Σ w_i x_i,   g = Σ w_i y_i + H,   w_i = m_i/Σ m,   f_i = w_i (F_t, F_n)

- normal: ΔF_n = -k_n Δg, k_n = k while g falls and k/e*² while it rises; contact begins at the gap
  g_0 (zero, or the residual deformation of an earlier loop until the face has left the surface)
  and ends at F_n = 0;
- tangential: F_t = -k_t (x_C - a), k_t = k η⁻², |F_t| <= μ F_n, the anchor a sliding on the cone
  (see `friction`). While slipping a moves with V_P = V_t - d/dt(-F_t/k_t): the anchor is the
  paper's massless particle P.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from reference_fem.friction import return_map

Array = NDArray[np.float64]

# Places of the law's memory ...
TOUCHING, FORCE, GAP, START_GAP, ANCHOR, TANGENTIAL = range(6)
MEMORY = 6
# ... and of the energies that one evaluation reports: stored now, and lost in this step.
STORED, FRICTION_LOSS, HYSTERESIS_LOSS = range(3)
ENERGIES = 3


@dataclass(frozen=True)
class LumpedContact:
    """Constants of the law.

    Parameters
    ----------
    normal_stiffness
        k, N/m, greater than 0.
    restitution
        e*, energetic coefficient, greater than 0 and at most 1.
    tangential_ratio
        η⁻², tangential over normal stiffness, at least 0; 0 transmits no tangential force.

    Raises
    ------
    ValueError
        Naming the key, its value and what is allowed.
    """

    normal_stiffness: float
    restitution: float = 1.0
    tangential_ratio: float = 0.75

    def __post_init__(self) -> None:
        for key, value, allowed, holds in (
            ("normal_stiffness", self.normal_stiffness, "above 0, N/m", self.normal_stiffness > 0),
            ("restitution", self.restitution, "above 0 and at most 1", 0 < self.restitution <= 1),
            ("tangential_ratio", self.tangential_ratio, "at least 0", self.tangential_ratio >= 0),
        ):
            if not (math.isfinite(value) and holds):
                raise ValueError(f"{key} = {value}: must be a finite number {allowed}")

    @property
    def stiffest(self) -> float:
        """Largest slope of the law, N/m: what the explicit step has to resolve."""
        return self.normal_stiffness * max(self.restitution**-2, self.tangential_ratio)


@njit(cache=True)
def lumped_force(
    x: float,
    gap: float,
    speed_x: float,
    speed_y: float,
    stiffness: float,
    restitution: float,
    tangential_ratio: float,
    friction: float,
    memory: Array,
    energies: Array,
) -> tuple[float, float]:
    """(F_t, F_n) on the tip, N; commits the law's memory.

    Losses come from the law itself, not from the work of the forces: friction -½(F_t + F_t')Δa
    (trapezoid), hysteresis ½(1 - e*²)(F'² - F²)/k while compressing; what both elements can give
    back is F_n² e*²/2k + F_t²/2k_t.

    Parameters
    ----------
    x, gap : m
    speed_x, speed_y
        Of the half step that led here, m/s: they place the crossing inside the step.
    memory : (MEMORY,)
        Changed in place. TOUCHING is 0 or 1.
    energies : (ENERGIES,)
        Filled.
    """
    energies[:] = 0.0
    if memory[TOUCHING] == 0.0:
        if gap > 0.0:
            memory[START_GAP] = 0.0
        if gap >= memory[START_GAP] or speed_y >= 0.0:
            return 0.0, 0.0
        since = (gap - memory[START_GAP]) / speed_y
        memory[TOUCHING] = 1.0
        memory[FORCE] = memory[TANGENTIAL] = 0.0
        memory[GAP] = memory[START_GAP]
        memory[ANCHOR] = x - since * speed_x
    before, closing = memory[FORCE], memory[GAP] - gap
    share = restitution * restitution
    slope = stiffness if closing > 0.0 else stiffness / share
    normal = before + slope * closing
    k_t = stiffness * tangential_ratio
    if normal <= 0.0:
        energies[FRICTION_LOSS] = _release(memory, k_t)
        # Where the branch reached zero, inside the step.
        memory[START_GAP] = min(0.0, memory[GAP] + before / slope)
        memory[TOUCHING] = 0.0
        return 0.0, 0.0
    tangential = 0.0
    if friction > 0.0 and k_t > 0.0:
        tangential, _, slip, _ = return_map(k_t, x - memory[ANCHOR], 0.0, friction * normal)
        memory[ANCHOR] += slip
        energies[FRICTION_LOSS] = -0.5 * (memory[TANGENTIAL] + tangential) * slip
        energies[STORED] = 0.5 * tangential * tangential / k_t
    if closing > 0.0:
        energies[HYSTERESIS_LOSS] = 0.5 * (1.0 - share) * (normal**2 - before**2) / stiffness
    energies[STORED] += 0.5 * normal * normal * share / stiffness
    memory[FORCE], memory[GAP], memory[TANGENTIAL] = normal, gap, tangential
    return tangential, normal


@njit(cache=True)
def _release(memory: Array, k_t: float) -> float:
    """Energy left in the tangential element when contact ends within a step: the anchor's slip."""
    left = 0.5 * memory[TANGENTIAL] ** 2 / k_t if k_t > 0.0 else 0.0
    memory[FORCE] = memory[TANGENTIAL] = 0.0
    return left

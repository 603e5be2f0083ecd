"""Sprague and Geers' metrics of two curves: magnitude, phase, both combined.

With psi_fg = int f g dt over the window, m the reference's curve and c the computed one,

    M = sqrt(psi_cc / psi_mm) - 1
    P = arccos(psi_mc / sqrt(psi_mm psi_cc)) / pi
    C = sqrt(M^2 + P^2)

Source: M. A. Sprague and T. L. Geers, A spectral-element method for modelling cavitation in
transient fluid-structure interaction, Int. J. Numer. Meth. Engng 60 (2004) 2467-2499.
Identical curves give 0, 0, 0; a curve scaled by 1.1 gives M = 0.1, P = 0; a curve and its
negative give P = 1. M is signed: positive where the computed curve is the larger one.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from validation.compare.force_curves import first_tap
from validation.harness.record import RunRecord


class SpragueGeers(NamedTuple):
    """Magnitude, phase and combined error, pure numbers."""

    magnitude: float
    phase: float
    combined: float


def sprague_geers(
    time: NDArray[Any], computed: NDArray[Any], reference: NDArray[Any]
) -> SpragueGeers:
    """Metrics of two curves on one time grid.

    time, computed, reference : (n,), time increasing.

    Raises ValueError: one of the curves is zero throughout, so that M and P are undefined.
    """
    sizes = [float(np.abs(curve).max()) for curve in (computed, reference)]
    if min(sizes) <= 0.0:
        raise ValueError("Sprague-Geers: a curve is zero throughout the window")
    # scaled to order one, so that no product underflows
    share = (time - time[0]) / (time[-1] - time[0])
    own, its = computed / sizes[0], reference / sizes[1]
    cc, mm, mc = (float(np.trapezoid(p, share)) for p in (own * own, its * its, own * its))
    magnitude = sizes[0] / sizes[1] * np.sqrt(cc / mm) - 1
    phase = np.arccos(np.clip(mc / np.sqrt(cc * mm), -1, 1)) / np.pi
    return SpragueGeers(float(magnitude), float(phase), float(np.hypot(magnitude, phase)))


def compare_forces(
    computed: RunRecord, reference: RunRecord, name: str = "normal_force_N"
) -> SpragueGeers | None:
    """Metrics of a contact force over the first tap, both curves aligned at t - t_c.

    The window reaches from first contact to the later of the two separations; the integrals use
    every step of both runs. None where a run has no finished contact or a curve is zero
    throughout (no friction).
    """
    found = first_tap((computed, reference), name)
    if found is None or not all(curve.any() for curve in found[1]):
        return None
    time, curves = found
    return sprague_geers(time, *curves)

"""Errors that mesh, contact springs and time steps leave in a tap's numbers.

- *Mesh*. A companion's edges are r times as long. Errors C h^p make its number q' differ from the
  run's q by (r^p - 1) C h^p, so that |q - q'| / |r^p - 1| is the run's error: p = 2 where the patch
  is resolved (linear elements, a smooth pressure), else 1 (a node's force on a patch smaller than
  an edge). Two meshes may agree by chance: the least stated is a share of what `Resolution` allows,
  and all of that without a companion.
- *Springs* of the contact law, in series with the body. If they hold the share s of the elastic
  energy, F_true / F = (1 - s)^-1/2 and t_true / t = (1 - s)^1/2 (two springs, one mass). Both runs'
  numbers are corrected for this before they are compared.
- *Shafts*. Linear cells are too stiff in bending, by the square of their lengths; patch and shafts
  may shift a number in opposite ways, so that two meshes agree though both are off.
- *Steps*. A node arrives and leaves within a step: times are known to within some Δt.

These errors add up. Of two extremes that differ by less than their errors either may be the larger
(`rivals`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.cautions import held_by_springs
from reference_fem.results.result import TapResult
from reference_fem.results.summary import PROMINENCE, confirmed_maxima, stress_during

STRESS, IMPULSE = "peak_stress_R_Pa", "normal_impulse_N_s"
PEAK, PEAK_TIME = "peak_normal_force_N", "peak_normal_force_time_s"
TANGENTIAL, DURATION = "peak_tangential_force_N", "contact_duration_s"
STIFFNESS_EXPONENTS = {  # exponents of (1 - s)
    PEAK: -0.5,
    TANGENTIAL: -0.5,
    STRESS: -0.5,
    PEAK_TIME: 0.5,
    DURATION: 0.5,
    IMPULSE: 0.0,
}
# d ln(impulse) / d ln(duration) between springs of any stiffness, measured: 0.2 at most.
IMPULSE_OF_TIME = 0.2
# Largest edge over the patch's radius at which its pressure is resolved.
RESOLVED = 0.5
# Relative error of forces and durations where an edge is as long as the patch's radius, and the
# power of the edge that it goes with (measured: 25 % at 2.3, 2.5 % at 0.7, 0.5 % at 0.4). OF_PATCH:
# factors for the impulse and for friction, which depends on the nodes that stick (in 199 scenes its
# error over this had the median 0.65, 90 % 1.7, 95 % 2.4; normal force 0.37, 0.94, 1.5).
AT_RADIUS, EDGE_EXPONENT = 0.06, 1.5
OF_PATCH = {IMPULSE: 0.25, TANGENTIAL: 1.8}
# Relative errors of the numbers, and of the stress at R, where a shaft's cells are as long as its
# diameter; they go with the square of that ratio. Measured: 0.5 % at 0.2; for the stress, against a
# ratio of 0.067 in 14 scenes, 3.2 to 7 % at 0.4, 0.5 to 1.4 % at 0.2, up to 0.3 % at 0.1. Added to
# the patch's error it leaves 2 % of 196 impulses beyond twice the stated error, instead of it 8 %.
OF_SECTION, OF_STRESS = 0.15, 0.45
# Least share of the patch's error (`allowance`) that is stated, however well two meshes agree.
LEAST_SHARE = 1.0 / 3.0
# Factor on the mesh's error in plane stress: against meshes of 0.4 times the finest edges, 8 of 46
# taps at 1e-2 had numbers beyond twice the stated error without it, none of 42 with it.
PLANE = 2.0
# Ratio of edges below which a companion tells next to nothing.
LEAST_RATIO = 1.2
# Steps by which a touch or a separation may be off.
STEP_UNCERTAINTY = 2.0


@dataclass(frozen=True)
class Resolution:
    """How finely a run resolves its contact.

    edge : edge length at the contact, m
    patch : Hertz's radius at the run's peak force, m
    section : length of the shafts' cells along the axis over their diameter
    dim : 3, or 2 in plane stress
    """

    edge: float
    patch: float
    section: float = 0.0
    dim: int = 3

    @property
    def edge_over_patch(self) -> float:
        """Edge length at the contact over the patch's radius."""
        return self.edge / self.patch

    @property
    def allowance(self) -> float:
        """Relative error of forces and durations that edges of this length may leave."""
        return AT_RADIUS * self.edge_over_patch**EDGE_EXPONENT

    def alone(self, name: str) -> float:
        """Relative error that a mesh may leave in a number, as estimated without a companion."""
        return self.allowance * OF_PATCH.get(name, 1.0) + self.bending(name)

    def bending(self, name: str) -> float:
        """Relative error that the shafts' cells may leave in a number."""
        return (OF_STRESS if name == STRESS else OF_SECTION) * self.section**2


@dataclass(frozen=True)
class CompanionRun:
    """The companion's run, and its edges over the run's: at the contact, and on average."""

    run: TapResult
    ratios: tuple[float, float]

    def error_factor(self, order: float) -> float:
        """1 / |r^p - 1|, r the ratio nearer to 1 but no nearer than `LEAST_RATIO`, p the order."""
        low, high = min(self.ratios), max(self.ratios)
        ratio = max(low, LEAST_RATIO) if self.ratios[1] > 1.0 else min(high, 1.0 / LEAST_RATIO)
        return 1.0 / abs(ratio**order - 1.0)


def tap_errors(
    run: TapResult, companion: CompanionRun | None, resolution: Resolution
) -> dict[str, float]:
    """Absolute errors of the contact's numbers; inf where the companion has no such number.

    companion : None: the mesh's error is estimated from the resolution alone.
    """
    soft, softer = springs(run), 0.0 if companion is None else springs(companion.run)
    ratio, allowance = resolution.edge_over_patch, resolution.allowance
    least = allowance * min(max(ratio, LEAST_SHARE), 1.0)
    order = 2.0 if ratio < RESOLVED else 1.0
    errors = {}
    for name, exponent in STIFFNESS_EXPONENTS.items():
        value = getattr(run.summary, name)
        if value is None:
            continue
        stiff = value * (1.0 - soft) ** exponent
        mesh = least * OF_PATCH.get(name, 1.0) * abs(value)
        if name == IMPULSE:
            contact = IMPULSE_OF_TIME * abs(value) * (1.0 - math.sqrt(1.0 - soft))
        else:
            contact = abs(stiff - value)
        if companion is None:
            mesh = resolution.alone(name) * abs(value)
        else:
            its = getattr(companion.run.summary, name)
            ended = its is not None and companion.run.summary.contact_duration_s is not None
            apart = abs(stiff - its * (1.0 - softer) ** exponent) if ended else math.inf
            mesh = max(mesh, companion.error_factor(order) * apart)
            mesh += resolution.bending(name) * abs(value)
        steps = STEP_UNCERTAINTY * run.summary.time_step_s if exponent > 0.0 else 0.0
        errors[name] = (PLANE if resolution.dim == 2 else 1.0) * mesh + contact + steps
    # a smooth maximum is flat: F (1 - (π t/T)²/2) is disturbed by a quarter of `least`, as
    # measured, in plane stress by half of the peak's error: waves may make it flatter still
    whole, peak = run.summary.contact_duration_s, run.summary.peak_normal_force_N
    if PEAK_TIME in errors and whole is not None and peak:
        share = 0.5 * least if resolution.dim == 3 else errors[PEAK] / peak
        errors[PEAK_TIME] = max(errors[PEAK_TIME], whole / math.pi * math.sqrt(share))
    return errors


def rivals(run: TapResult, errors: Mapping[str, float]) -> dict[str, float]:
    """Errors of those extremes of the first tap for which another one may be mistaken.

    A value known to ε is the maximum for certain only if no other comes within 2 ε of it. Else a
    peak's time may be off by the time between the two, and a signed extreme by the distance to that
    of the other sign. A stress that grows as the tap ends is only as certain as its end.
    """
    start, whole = run.summary.contact_time_s, run.summary.contact_duration_s
    if start is None or whole is None:
        return {}
    found = {}
    forces = run.forces
    tap = (forces.time_s >= start) & (forces.time_s <= start + whole)
    stress = stress_during(run.history, start, start + whole)
    for name, during in ((STRESS, stress), (TANGENTIAL, forces.tangential_force_N[tap])):
        least, most = during.min(initial=0.0), during.max(initial=0.0)
        if name in errors and 0.0 < max(most, -least) <= min(most, -least) + 2.0 * errors[name]:
            found[name] = max(errors[name], float(most - least))
    if STRESS in errors and DURATION in errors:
        largest = float(np.abs(stress).max(initial=0.0))
        for end in (start + whole - errors[DURATION], start + whole + errors[DURATION]):
            there = np.abs(stress_during(run.history, start, max(end, start))).max(initial=0.0)
            found[STRESS] = max(found.get(STRESS, errors[STRESS]), abs(float(there) - largest))
    normal, since = forces.normal_force_N[tap], forces.time_s[tap] - start
    tops = np.array(confirmed_maxima(normal, PROMINENCE * normal.max(initial=0.0)), dtype=int)
    if tops.size and PEAK_TIME in errors:
        high = since[tops[normal[tops] >= normal.max() - 2.0 * errors[PEAK]]]
        apart = np.abs(high - run.summary.peak_normal_force_time_s).max(initial=0.0)
        found[PEAK_TIME] = max(errors[PEAK_TIME], float(apart))
    return found


def springs(run: TapResult) -> float:
    """Largest share of the elastic energy that the contact law's springs hold in the first tap,
    below 1.
    """
    return min(held_by_springs(run.history, run.summary.first_tap_end_s), 0.99)


def spacing(mesh: meshes.FingerMesh, angle: float) -> float:
    """Edge length where the last phalanx, turned by `angle`, is lowest, m: of a square whose
    diagonal is the mean of the facets' there, so that those long across the motion count as such.
    """
    facets = mesh.facet_sets["surface"]
    height = math.sin(angle) * mesh.points[:, 0] + math.cos(angle) * mesh.points[:, 1]
    low = facets.flat[np.argmin(height[facets])]
    around = mesh.points[facets[(facets == low).any(axis=1)]]
    diagonals = np.linalg.norm(around - mesh.points[low], axis=2).max(axis=1)
    return float(diagonals.mean()) / math.sqrt(mesh.dim - 1)

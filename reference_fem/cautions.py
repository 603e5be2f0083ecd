"""Reasons not to trust a run's numbers, from its own record and its stated errors."""

import math
from collections.abc import Mapping

import numpy as np

from reference_fem.accuracy import EDGE, FLUTTER_FRICTION, RELAXATION_SHARE
from reference_fem.arrays import Array, Flags
from reference_fem.model import Model
from reference_fem.result import ForceRecord, History, Snapshot, Summary
from reference_fem.settings import Material, Settings

# Limit of the second difference of F_n at its peak over three times the peak, for lags of one step
# up to the time that a wave takes across a cell (the longest, τ). A wave of frequency ω gives (ω
# τ)²/3: the limit is that of 26 steps or cells per wavelength, where the errors of central
# differences and linear elements, (ω τ)²/24 to (ω τ)²/8, are below 1 %.
SPIKE = 0.02
# Fewest steps of a tap without a caution. A node arrives, sticks and leaves within a step: errors
# of up to 5 Δt over the tap's duration on the stability maps, so 5 % at this number.
FEWEST_STEPS = 100
# Residual of the energy balance over the largest kinetic energy above which a run is cautioned: the
# impulse of a rebound changes by about half of it.
CAUTION_RESIDUAL = 0.02
# Volume ratio below which St. Venant-Kirchhoff's law softens when confined: d/dλ λ(λ² - 1) = 0.
CRUSHED = 3.0**-0.5
# Largest share of the elastic energy in the contact's springs: in series with the body they change
# force and duration by half of it.
SPRINGS = 0.1
# Mean edge at the contact at peak force over the finest, above which the contact lies outside the
# refined patch; and long edges over the finest, below which a mesh counts as even.
REFINED_EDGE_RATIO, EVEN = 1.5, 3.0
# Distance from its pole, over its radius, up to which a phalanx touches with its end.
END = 1.1
# The usual limit of hourglass control (LS-DYNA's and Abaqus' guides: 5 to 10 %).
HOURGLASS = 0.1
# Share of mu F_n above which a tip slides as a whole.
SLIP_SHARE = 0.9
# Relative error that a number may state without a caution.
CAUTION_ERROR = 0.02
TITLES = {
    "contact_time_s": "time of contact",
    "tip_velocity_at_contact_m_per_s": "tip velocity at contact",
    "peak_normal_force_N": "peak normal force",
    "peak_normal_force_time_s": "time of the peak",
    "peak_tangential_force_N": "peak tangential force",
    "contact_duration_s": "contact duration",
    "normal_impulse_N_s": "normal impulse",
    "peak_stress_R_Pa": "peak stress at R",
}
"""The numbers with an estimate, by the summary's fields."""


def cautions(
    forces: ForceRecord,
    history: History,
    snapshots: tuple[Snapshot, ...],
    model: Model,
    settings: Settings,
) -> tuple[str, ...]:
    """One sentence for each reason to doubt a number, most often none.

    - the peak force stands out so much that step or mesh have not resolved it
    - the tap is so short that a step is a noticeable part of it
    - the energy balance is off by more than a rebound's impulse tolerates
    - an element is crushed so far that its material law no longer models a solid
    - penalty springs hold so much of the elastic energy that they, not the body, make the contact
    - hourglass control holds so much of the strain energy that it affects the answer
    - the contact has rolled out of the refined part of the mesh, or never was there
    - the last phalanx touches with its shaft
    """
    found = []
    if spike(forces.normal_force_N, steps_per_cell_transit(model)) > SPIKE:
        found.append(
            "the peak normal force is a spike of a few steps or elements that another step or "
            f"mesh changes: use {_smoother(settings)}"
        )
    steps = int(np.count_nonzero(forces.normal_force_N > 0.0))
    if 0 < steps < FEWEST_STEPS:
        found.append(
            f"the surface is touched in {steps} steps only: halve solver.fem.step_factor and "
            "see what it changes, or refine the mesh"
        )
    if not history.time_s.size:
        return tuple(found)
    residual = _share(
        float(np.abs(history.energy_balance_J).max()), float(history.kinetic_energy_J.max())
    )
    if residual > CAUTION_RESIDUAL:
        impulse = settings.contact == "impulse"
        plastic = " (impulses stop nodes as plastic impacts do)" if impulse else ""
        found.append(
            f"{100 * residual:.3g} % of the largest kinetic energy was lost or gained: lower "
            f"solver.fem.step_factor, and refine the mesh where it touches{plastic}"
        )
    smallest = min(
        (model.kernel.min_det_F(s.displacement) for s in snapshots if s.at_peak), default=1.0
    )
    if smallest < CRUSHED:
        found.append(
            f"an element is crushed to {100 * smallest:.3g} % of its volume, where the material "
            "law (St. Venant-Kirchhoff) softens: use a stiffer material or a slower impact"
        )
    touched = [s.contact_pressure_Pa[model.contact.nodes] > 0.0 for s in snapshots if s.at_peak]
    edges = np.sqrt(model.contact.area) if model.points.shape[1] == 3 else np.zeros(0)
    times = contact_edge_ratio(edges, touched[0]) if edges.size and touched else None
    body = model.points[model.body_of_point == model.touching_body]
    last, radius = body[:, 0].max(), body[:, 1].max()
    under = model.contact.nodes[touched[0]] if touched else model.contact.nodes[:0]
    at = model.points[under, 0].mean() if under.size else -math.inf
    away = 1e3 * (last - at)
    if at > body[:, 0].min() + END * radius:
        found.append(
            f"at the peak force the shaft touches, {away:.3g} mm from the last hinge, not the "
            "end, which the reduced model cannot represent: raise or lower surface.height so that "
            "the end touches"
        )
    if times is not None:
        found.append(
            f"at the peak force it touches {away:.3g} mm from the last hinge, where edges are "
            f"{times:.2g} times those refined for contact: refine a larger part "
            "(solver.fem.patch_size, solver.fem.growth)"
        )
    strain = float(history.strain_energy_J.max())
    elastic = history.strain_energy_J + history.contact_energy_J
    springs = _share(float(history.contact_energy_J.max()), float(elastic.max()))
    if springs > SPRINGS and isinstance(settings.contact, str):
        found.append(
            f"the contact's springs hold {100 * springs:.3g} % of the elastic energy, so the "
            f"penalty sets force and duration: raise solver.fem.{settings.contact}_factor or use "
            "solver.fem.contact = 'impulse'"
        )
    hourglass = _share(float(history.hourglass_energy_J.max()), strain)
    if hourglass > HOURGLASS:
        found.append(
            f"hourglass control holds {100 * hourglass:.3g} % of the strain energy: refine the "
            "mesh or use solver.fem.element = 'hex8-sri'"
        )
    return tuple(found)


def steps_per_cell_transit(model: Model) -> int:
    """Steps that a wave takes to cross a cell, at least one."""
    return max(1, round(model.cell_transit_s / model.step_s))


def spike(normal: Array, longest: int) -> float:
    """Largest (2 F_p - F_{p-k} - F_{p+k}) / 3 F_p over lags of k = 1 to `longest` steps.

    F_p is the peak; forces (n,) are zero beyond their ends. Several lags are tried, as one equal to
    the period of the spike's own chatter shows nothing.
    """
    if not normal.size or normal.max() <= 0.0:
        return 0.0
    padded = np.concatenate([np.zeros(longest), normal, np.zeros(longest)])
    top = longest + int(np.argmax(normal))
    lags = np.arange(1, longest + 1)
    beside = padded[top - lags] + padded[top + lags]
    return float(np.max(2.0 * padded[top] - beside) / (3.0 * padded[top]))


def contact_edge_ratio(edges: Array, touched: Flags) -> float | None:
    """Mean edge of the nodes that touch over the 2 % quantile of all; None within a refined patch.

    edges, touched : (k,), of the nodes that may touch; edges are the roots of their areas. An even
        mesh has no refined patch and gives None.
    """
    if not touched.any() or not np.isfinite(edges).all():
        return None
    finest, coarsest = np.quantile(edges, (0.02, 0.9))
    if coarsest < EVEN * finest:
        return None
    times = float(np.sqrt(np.mean(edges[touched] ** 2)) / finest)
    return times if times > REFINED_EDGE_RATIO else None


def _share(part: float, whole: float) -> float:
    return part / whole if whole > 0.0 else 0.0


def _smoother(settings: Settings) -> str:
    """The remedies left: a finer mesh and, unless in use, impulses, or a softer contact."""
    finer = "a finer mesh where it touches"
    if settings.contact == "impulse":
        return finer
    return f"solver.fem.contact = 'impulse', a softer contact, or {finer}"


def imprecise(
    summary: Summary,
    errors: Mapping[str, float | tuple[float, float]],
    of_mesh: Mapping[str, float],
    edge_over_patch: float,
) -> tuple[str, ...]:
    """A line that names numbers with relative errors above `CAUTION_ERROR`, and asks for a finer
    mesh where that may remove half of one.

    of_mesh : parts of errors that it may reduce. edge_over_patch : see `mesh_error.Resolution`
    """
    found = _shares(summary, errors)
    names = sorted((name for name in found if found[name] > CAUTION_ERROR), key=found.__getitem__)
    poor = {name: found[name] for name in reversed(names)}
    if not poor:
        return ()
    known = ", ".join(f"{TITLES[name]} {percent(share)}" for name, share in poor.items())
    line = f"estimated errors beyond {percent(CAUTION_ERROR)}: {known}"
    by_mesh = _shares(summary, of_mesh)
    if any(0.5 * poor[name] <= by_mesh.get(name, 0.0) < math.inf for name in poor):
        line += (
            f"; an edge where it touches is {edge_over_patch:.2g} of the patch's radius: refine "
            "the mesh, there first (solver.fem.tip_size)"
        )
    return (line,)


def flutter(
    forces: ForceRecord, friction: float, material: Material, edge: float, patch: float
) -> tuple[str, ...]:
    """A caution if an undamped tip slides on a mesh fine enough to show that it flutters.

    edge : edge length at the contact, m. patch : Hertz's radius, m
    """
    normal, tangential = forces.normal_force_N, forces.tangential_force_N
    pushed = normal > 0.5 * normal.max(initial=0.0)
    slides = np.abs(tangential[pushed]) > SLIP_SHARE * friction * normal[pushed]
    damped = friction < FLUTTER_FRICTION or material.relaxation_time > 0.0
    if damped or edge > EDGE * patch or not slides.any():
        return ()
    time_s = RELAXATION_SHARE * patch / material.bar_speed
    return (
        "a sliding elastic tip flutters, and meshes this fine do not converge: of 74 fingers 20 "
        "had a peak or an impulse more than 1 % off, by up to 11 %; set "
        f"material.relaxation_time = {time_s:.2g}, as runs that are given an accuracy do",
    )


def _shares(
    summary: Summary, errors: Mapping[str, float | tuple[float, float]]
) -> dict[str, float]:
    """Relative errors, by name: the largest component over the magnitude of the number."""
    return {
        name: float(np.max(error) / max(np.linalg.norm(getattr(summary, name)), 1e-300))
        for name, error in errors.items()
    }


def percent(share: float) -> str:
    """A share as text, in per cent with two digits; "unknown" if infinite."""
    if share == math.inf:
        return "unknown"
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"

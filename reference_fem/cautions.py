"""Reasons not to trust a run, from its own record."""

import math
from typing import NamedTuple

import numpy as np

from reference_fem.arrays import Array, Flags
from reference_fem.model import Model
from reference_fem.results.result import ForceRecord, History, Snapshot
from reference_fem.settings import NEO_HOOKE, Settings

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


class Evidence(NamedTuple):
    """What a run's cautions are judged by.

    forces : up to over_s, s, the end of the first tap; inf if it has not ended.
    """

    forces: ForceRecord
    history: History
    snapshots: tuple[Snapshot, ...]
    model: Model
    settings: Settings
    over_s: float

    @property
    def touched(self) -> list[Flags]:
        """Which of the nodes that may touch do so at the peak force; empty if that is not known."""
        nodes = self.model.contact.nodes
        return [s.contact_pressure_Pa[nodes] > 0.0 for s in self.snapshots if s.at_peak][:1]

    @property
    def place(self) -> float:
        """Mean X of these nodes at rest, m; -inf if there are none."""
        under = [self.model.contact.nodes[touched] for touched in self.touched]
        if not under or not under[0].size:
            return -math.inf
        return float(self.model.points[under[0], 0].mean())

    @property
    def body(self) -> Array:
        """Nodes of the phalanx that touches, at rest, m."""
        return self.model.points[self.model.body_of_point == self.model.touching_body]

    @property
    def away_mm(self) -> float:
        """Distance of the place that touches from the last hinge."""
        return 1e3 * (float(self.body[:, 0].max()) - self.place)


def cautions(evidence: Evidence) -> tuple[str, ...]:
    """One sentence for each reason to doubt a number, most often none."""
    doubts = CAUTIONS if evidence.history.time_s.size else CAUTIONS_OF_FORCES
    return tuple([line for doubt in doubts if (line := doubt(evidence))])


SPIKED = (
    "the peak normal force is a spike of a few steps or elements that another step or mesh changes"
)


def spiked(run: Evidence) -> str:
    """The peak force stands out so much that step or mesh have not resolved it."""
    if spike(run.forces.normal_force_N, steps_per_cell_transit(run.model)) <= SPIKE:
        return ""
    return f"{SPIKED}: use {_smoother(run)}"


def few_steps(run: Evidence) -> str:
    """The tap is so short that a step is a noticeable part of it."""
    steps = int(np.count_nonzero(run.forces.normal_force_N > 0.0))
    if not 0 < steps < FEWEST_STEPS:
        return ""
    return (
        f"the surface is touched in {steps} steps only: halve solver.fem.step_factor and "
        "see what it changes, or refine the mesh"
    )


def open_energy(run: Evidence) -> str:
    """The energy balance is off by more than a rebound's impulse tolerates."""
    residual = _share(
        float(np.abs(run.history.energy_balance_J).max()),
        float(run.history.kinetic_energy_J.max()),
    )
    if residual <= CAUTION_RESIDUAL:
        return ""
    impulse = run.settings.contact == "impulse"
    plastic = " (impulses stop nodes as plastic impacts do)" if impulse else ""
    return (
        f"{100 * residual:.3g} % of the largest kinetic energy was lost or gained: lower "
        f"solver.fem.step_factor, and refine the mesh where it touches{plastic}"
    )


def crushed(run: Evidence) -> str:
    """An element is crushed so far that its material law no longer models a solid."""
    smallest = min(
        (run.model.kernel.min_det_F(s.displacement) for s in run.snapshots if s.at_peak),
        default=1.0,
    )
    if smallest >= run.model.kernel.kind.softens:
        return ""
    return (
        f"an element is crushed to {100 * smallest:.3g} % of its volume, where the material "
        "law (St. Venant-Kirchhoff) softens: use a stiffer material, a slower impact or, in 3D, "
        f"another law (material.law = '{NEO_HOOKE}')"
    )


def shaft_touches(run: Evidence) -> str:
    """The last phalanx touches with its shaft."""
    body = run.body
    if run.place <= body[:, 0].min() + END * body[:, 1].max():
        return ""
    return (
        f"at the peak force the shaft touches, {run.away_mm:.3g} mm from the last hinge, not the "
        "end, which the reduced model cannot represent: raise or lower surface.height so that "
        "the end touches"
    )


def outside_refined_patch(run: Evidence) -> str:
    """The contact has rolled out of the refined part of the mesh, or never was there."""
    model = run.model
    edges = np.sqrt(model.contact.area) if model.points.shape[1] == 3 else np.zeros(0)
    times = contact_edge_ratio(edges, run.touched[0]) if edges.size and run.touched else None
    if times is None:
        return ""
    return (
        f"at the peak force it touches {run.away_mm:.3g} mm from the last hinge, where edges are "
        f"{times:.2g} times those refined for contact: refine a larger part "
        "(solver.fem.patch_size, solver.fem.growth)"
    )


def soft_springs(run: Evidence) -> str:
    """Penalty springs hold so much of the elastic energy that they, not the body, set the force."""
    springs = held_by_springs(run.history, run.over_s)
    if springs <= SPRINGS or not isinstance(run.settings.contact, str):
        return ""
    return (
        f"the contact's springs hold {100 * springs:.3g} % of the elastic energy, so the "
        f"penalty sets force and duration: raise solver.fem.{run.settings.contact}_factor or use "
        "solver.fem.contact = 'impulse'"
    )


def hourglassed(run: Evidence) -> str:
    """Hourglass control holds so much of the strain energy that it affects the answer."""
    tap = run.history.time_s <= run.over_s
    strain = float(run.history.strain_energy_J[tap].max())
    hourglass = _share(float(run.history.hourglass_energy_J[tap].max()), strain)
    if hourglass <= HOURGLASS:
        return ""
    return (
        f"hourglass control holds {100 * hourglass:.3g} % of the strain energy: refine the "
        "mesh or use solver.fem.element = 'hex8-sri'"
    )


CAUTIONS_OF_FORCES = (spiked, few_steps)
CAUTIONS = (
    *CAUTIONS_OF_FORCES,
    *(open_energy, crushed, shaft_touches, outside_refined_patch, soft_springs, hourglassed),
)


def held_by_springs(history: History, over_s: float) -> float:
    """Largest share of the elastic energy that the contact law's springs hold up to a time, s."""
    tap = history.time_s <= over_s
    held = history.contact_energy_J[tap]
    elastic = history.strain_energy_J[tap] + held
    return _share(float(held.max(initial=0.0)), float(elastic.max(initial=0.0)))


def steps_per_cell_transit(model: Model) -> int:
    """Steps that a wave takes to cross a cell, at least one."""
    return max(1, round(model.cell_transit_s / model.step_s))


def spike(force: Array, longest: int) -> float:
    """Largest (2 F_p - F_{p-k} - F_{p+k}) / 3 F_p over lags of k = 1 to `longest` steps.

    F_p is the peak; the sizes of the force (n,) are zero beyond their ends. Several lags are tried,
    as one equal to the period of the spike's own chatter shows nothing.
    """
    if not force.size or force.max() <= 0.0:
        return 0.0
    padded = np.concatenate([np.zeros(longest), force, np.zeros(longest)])
    top = longest + int(np.argmax(force))
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


def _smoother(run: Evidence) -> str:
    """The remedies left: a finer mesh and, unless in use, impulses, or a softer contact; a pressure
    instead of impulses that stop the nodes of a material that relaxes.
    """
    finer = "a finer mesh where it touches"
    if run.settings.contact == "impulse":
        relaxes = run.model.kernel.relaxation.any()
        return f"solver.fem.contact = 'surface', or {finer}" if relaxes else finer
    return f"solver.fem.contact = 'impulse', a softer contact, or {finer}"

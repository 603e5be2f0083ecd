"""Fingers, states and systems with closed forms that the reduced model's tests share."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

import hcm
from hcm import loop
from hcm.arrays import Floats
from hcm.assembly.equations import residual, tangent
from hcm.assembly.minimal_coordinates import acceleration, expand, minimal_coordinates
from hcm.assembly.state import Motion, RunTotals, StepLimits, build_motion, initial_totals
from hcm.assumptions import Assumptions
from hcm.beam.banded_ldl import HALF_BANDWIDTH, storage
from hcm.beam.chain import Chain, build_chain
from hcm.beam.outline import Outline
from hcm.beam.probe import Probe
from hcm.beam.refinement import beams_of, refine_chain
from hcm.contact.law import IN_FLIGHT, ContactLaw, ContactState, contact_law
from hcm.integrators.gauss_tableau import with_collocation
from hcm.integrators.generalized_alpha import initial_acceleration
from hcm.integrators.workspace import Integrator, coefficients, workspace
from hcm.parameters import STAGES
from hcm.reference_solution import ChainStart
from hcm.results.record import FrameTable, empty_record, write_row
from hcm.results.result import COLUMNS, EVENT_KINDS, Event

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)
HARD = hcm.Phalanx(0.04, 0.015, 20e9, 1048.7, elements=5)
SURFACE = hcm.Surface(height=0.1, friction=0.5)
SOFT_TIP = hcm.Tip(0.78e6)
HARD_TIP = hcm.Tip(5.15e6)
NO_ESTIMATE = hcm.Settings(estimate=False)
SOFT_SCENE = hcm.Scene(hcm.Finger((SOFT,) * 3), SURFACE, SOFT_TIP, settings=NO_ESTIMATE)
# one phalanx that a sudden torque rings: its vibration changes the tap by a tenth
RINGING = hcm.Scene(
    hcm.Finger((hcm.Phalanx(0.0285, 0.0114, 1.3e7, 2000.0),)), hcm.Surface(0.0124, 0.85),
    hcm.Tip(4000.0), hcm.Drive((0.0106,)),
)  # fmt: skip
SOFT_LAW = contact_law(SURFACE, SOFT_TIP)
NOWHERE = ContactLaw(1.0, 1.0, 0.75, 0.0, 1e6)  # a surface out of reach
# The soft finger's tap from rest by `hcm.reference_solution`: DOP853, rtol 1e-10, known to 1e-7.
TRUTH = {
    "contact_time_s": 0.13610709065870444,
    "contact_duration_s": 0.13633946570634775 - 0.13610709065870444,
    "peak_normal_force_N": 64.47781232119031,
}

# Links right above SURFACE that turn towards it: rad from +X, and rad/s.
STRIKING = np.array([
    *np.radians([255.0, 240.0]),
    np.pi + np.arcsin(0.1 / 0.04 - np.sin(np.radians(75)) - np.sin(np.radians(60))),
])  # fmt: skip
SPINS = np.array([12.0, 14.0, 40.0])


def order_of(steps: Floats, errors: Sequence[float]) -> float:
    """Observed order: the slope of log(error) over log(step)."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def finger(phalanx: hcm.Phalanx, count: int = 3, **changes: float) -> hcm.Finger:
    return hcm.Finger((replace(phalanx, **changes),) * count)


def straight_links(
    body: hcm.Finger,
    angles: Floats = STRIKING,
    spins: Floats = SPINS,
    drive: hcm.Drive | None = None,
) -> tuple[Chain, ChainStart]:
    """Unstrained links that point along `angles` (rad from +X) and turn at `spins` (rad/s)."""
    chain, rest = build_chain(body, drive or hcm.Drive())
    q, v = np.zeros_like(rest), np.zeros_like(rest)
    base, speed, element = np.zeros(2), np.zeros(2), 0
    for phalanx, angle, spin in zip(body.phalanges, angles, spins, strict=True):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = spin * np.array([-along[1], along[0]])
        el = phalanx.length / phalanx.elements
        places = [chain.first[element], *chain.second[element : element + phalanx.elements]]
        for i, place in enumerate(places):
            q[place : place + 4] = *(base + i * el * along), *along
            v[place : place + 4] = *(speed + i * el * across), *across
        base, speed = base + phalanx.length * along, speed + phalanx.length * across
        element += phalanx.elements
    return chain, ChainStart(q, v)


def dense_of(rows: Floats) -> Floats:
    """The symmetric matrix (n, n) that `banded_ldl`'s rows (w + n, w + 1) store."""
    w, n = HALF_BANDWIDTH, len(rows) - HALF_BANDWIDTH
    dense = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - w), i + 1):
            dense[i, j] = dense[j, i] = rows[w + i, w - i + j]
    return dense


def mode_near(frequency: float, chain: Chain, rest: np.ndarray) -> tuple[float, np.ndarray]:
    """Frequency of the mode nearest to one, rad/s, and its shape (n,) with entries up to 1 m.

    Rigid rotations are left out: 1 rad/s means the lowest.
    """
    source = minimal_coordinates(chain).source
    free = np.zeros((rest.size, int(source.max()) + 1))
    free[source >= 0, source[source >= 0]] = 1.0

    def reduced(weight: float) -> np.ndarray:
        rows = storage(rest.size)
        tangent(rest, weight, 0.0, chain, IN_FLIGHT, NOWHERE, rows)
        unscaled = dense_of(rows) / np.outer(chain.scale, chain.scale)
        return free.T @ unscaled @ free

    mass = reduced(0.0)
    squares, shapes = eigh(reduced(1.0) - mass, mass)
    frequencies = np.sqrt(np.where(squares > 1.0, squares, np.inf))
    found = int(np.argmin(np.abs(np.log(frequencies / frequency))))
    shape = free @ shapes[:, found]
    return float(frequencies[found]), shape / np.abs(shape / chain.scale).max()


@dataclass(frozen=True)
class Run:
    """What the compiled loop made of a start: its rows, events, and the state at the end."""

    table: Floats
    reactions: Floats
    events: tuple[Event, ...]
    motion: Motion
    contact: ContactState
    totals: RunTotals
    code: int

    def __getitem__(self, column: str) -> Floats:
        return self.table[:, COLUMNS.index(column)]

    def kinds(self) -> list[str]:
        return [e.kind for e in self.events]

    def time_of(self, kind: str, occurrence: int = 0) -> float:
        return [e.time_s for e in self.events if e.kind == kind][occurrence]


def integrate(
    chain: Chain,
    law: ContactLaw,
    start: ChainStart,
    step: float,
    *,
    xi: float = 0.8,
    end_time: float = np.inf,
    taps: int = 1,
    rows: int = 20_000,
    newton_tolerance: float = 1e-12,
    collocation: bool = False,
    in_contact: bool = False,
    stages: int = STAGES,
) -> Run:
    """Run the compiled loop from any state with one fixed step in flight and contact.

    collocation, in_contact : whether its flight, or all of it, is integrated by Gauss collocation.
    """
    n = chain.scale.size
    old, new = (build_motion(chain, start.coordinates, start.velocities) for _ in range(2))
    plain = Integrator(coefficients(xi, newton_tolerance), chain, law, workspace(n))
    integrator = with_collocation(plain, stages, True, in_contact) if collocation else plain
    totals = initial_totals(start.time_s, step)
    limits = StepLimits(step, step, taps, end_time, 0.0, 0.0, np.inf, np.inf)
    probe = Probe(
        np.full(2, chain.first.size - 1), *np.full((2, 2), 0.5), 1.0, 0.0, 1.0, np.zeros(3)
    )
    without_body = Outline(np.empty(0), 0, 0.0, 0.0, 1e6)
    assert initial_acceleration(old, start.contact, plain)
    record = empty_record(rows + 1, rows, chain, FrameTable(np.empty(0), np.empty((0, n))))
    table, reactions, located, _ = record
    write_row(table[0], reactions[0], old, totals, start.contact, plain, probe)
    contact, totals, n_rows, n_events, code = loop.advance(
        old, new, start.contact, totals, limits, integrator, probe, without_body,
        record._replace(rows=table[1:], reactions=reactions[1:]),
    )  # fmt: skip
    events = tuple(
        Event(float(t), EVENT_KINDS[k])
        for t, k in zip(located.time[:n_events], located.kind[:n_events], strict=True)
    )
    return Run(
        table[: n_rows + 1], reactions[: n_rows + 1], events, old, ContactState(*contact),
        RunTotals(*totals), code,
    )  # fmt: skip


# An anchor this much heavier than the mass moves uniformly, whatever pulls on it.
HEAVY = 1e16


def point_mass(
    mass: float,
    position: tuple[float, float],
    velocity: tuple[float, float],
    force: tuple[float, float] = (0.0, 0.0),
    spring: float = 0.0,
    anchor: tuple[float, float] = (0.0, 0.0),
    anchor_velocity: tuple[float, float] = (0.0, 0.0),
) -> tuple[Chain, ChainStart]:
    """A free point mass at the tip node, under a constant force and a spring to a moving anchor.

    One element of unit length carries no axial stiffness. Its bending stiffness acts on slopes
    minus chord; with slopes held by inertia it is a linear spring between its nodes, the same in
    every direction: 2 (near + far)/l^2 of `internal_force`, unstretched where the chord is the
    slope. The anchor is its first node.
    """
    near = spring / 3.0
    bending = np.zeros((1, 4, 4))
    bending[0] = near * np.array(
        [[3.0, 1.5, -3.0, 1.5], [1.5, 1.0, -1.5, 0.5], [-3.0, -1.5, 3.0, -1.5], [1.5, 0.5, -1.5, 1]]
    )
    weight = np.zeros(8)
    weight[4:6] = force
    chain = Chain(
        first=np.array([0]),
        second=np.array([4]),
        length=np.array([1.0]),
        axial_stiffness=np.zeros(1),
        mass=np.diag([HEAVY, HEAVY, 1.0, HEAVY])[None] * mass,
        bending=bending,
        hinge=np.empty(0, dtype=np.int64),
        hinge_inner=np.empty(0, dtype=np.int64),
        hinge_outer=np.empty(0, dtype=np.int64),
        weight=weight,
        torque=np.empty(0),
        torque_node=np.empty(0, dtype=np.int64),
        scale=np.ones(8),
        tip=4,
        # one rounding of a position of order 1 m, through the spring
        roundoff=float(np.finfo(float).eps) * spring / mass,
        place_roundoff=1e-14,
        relaxation=np.zeros(1),
        damped=False,
    )
    slope = (1.0, 0.0)
    q = np.array([anchor[0] - 1.0, anchor[1], *slope, *position, *slope], dtype=float)
    v = np.array([*anchor_velocity, 0.0, 0.0, *velocity, 0.0, 0.0], dtype=float)
    return chain, ChainStart(q, v)


def bordered_acceleration(
    q: Floats, v: Floats, chain: Chain, contact: ContactState, law: ContactLaw
) -> Floats:
    """(q.., lam), (n,): lam closes the balance of the hinges' outer nodes."""
    mapping, out = minimal_coordinates(chain), np.empty(q.size)
    full = expand(acceleration(q, v, mapping, chain, contact, law), mapping.source)
    residual(q, v, full, chain, contact, law, out)
    for axis in range(2):
        full[chain.hinge + axis] = -out[chain.hinge_outer + axis]
    return full


def refined(body: hcm.Finger, assumptions: Assumptions) -> Chain:
    chain, _ = build_chain(beams_of(body, assumptions), hcm.Drive())
    return refine_chain(chain, body, hcm.Drive(), assumptions)


def transverse(chain: Chain) -> tuple[Floats, Floats]:
    """Stiffness and mass (2 m, 2 m) of one straight phalanx's deflections and slopes."""
    size = 2 * chain.first.size + 2
    stiffness, mass = np.zeros((2, size, size))
    for e in range(chain.first.size):
        own = slice(2 * e, 2 * e + 4)
        stiffness[own, own] += chain.bending[e]
        mass[own, own] += chain.mass[e]
    return stiffness, mass


def timoshenko(
    k: float, bending: float, line: float, turning: float = 0.0, soft: float = 0.0
) -> float:
    """w^2 of the lower branch of E I k^4 - [m + k^2 (J + E I m/S)] w^2 + (J m/S) w^4 = 0
    (Timoshenko 1922), m = rho A, J = rho I, S = kappa G A; soft : 1/S.
    """
    b = line + k**2 * (turning + bending * line * soft)
    a, c = turning * line * soft, bending * k**4
    return float(2 * c / (b + np.sqrt(b * b - 4 * a * c)))

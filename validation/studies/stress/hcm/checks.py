"""Invariants of a run of the reduced model, checked from its results alone.

Nothing here calls the solver's kernels: the contact law is replayed from the tip's path and the
modes, the events by an automaton, hinges, energies and momentum from the states at the events.
"""

from collections.abc import Iterator

import numpy as np

from hcm import Scene, Status, TapResult
from hcm.arrays import Floats
from hcm.contact.build import law_of
from hcm.contact.law import STICK, ContactLaw
from validation.studies.stress.hcm.audit import EPS, audit
from validation.studies.stress.judging import not_finite

# s per Newton iteration and element, a hundred times what a free core needs, and per run
ITERATION_BOUND_S, RUN_BOUND_S = 1e-4, 5.0
# Newton iterations a step may take on average: 2 to 4 in a smooth motion, more at located events
ITERATIONS_A_STEP = 20


def violations(scene: Scene, result: TapResult) -> list[str]:
    """What is wrong with a run, one sentence each; empty when all invariants hold.

    A refined tip's law, whose states the history does not hold, is not replayed; its tap may
    separate more than once.
    """
    checks = [_energy, _dissipation, _postures, _work]
    if not scene.assumptions.any:
        checks += [_ending, _contact_law, _cone, _events, audit]
    return list(_finite(result)) or [
        violation for check in checks for violation in check(scene, result)
    ]


def _finite(result: TapResult) -> Iterator[str]:
    yield from not_finite((result.history, result.summary))
    for posture in (*result.event_postures, *result.frames):
        if not all(np.isfinite(a).all() for a in (*posture.positions_m, *posture.slopes)):
            yield f"posture at {posture.time_s:g} s is not finite"
    if np.diff(result.history.time_s).min(initial=0.0) < 0:
        yield "time runs backwards"


def _ending(scene: Scene, result: TapResult) -> Iterator[str]:
    if result.status is not Status.COMPLETED:
        if not (result.message and result.status.advice):
            yield f"{result.status.name} without message or advice"
        return
    settings = scene.settings
    if settings.end_time is not None:
        if abs(result.history.time_s[-1] - settings.end_time) > 1e-9 * settings.end_time:
            yield "COMPLETED before its end time"
    elif sum(e.kind == "separation" for e in result.events) != settings.taps:
        yield "COMPLETED with another number of taps"


def _energy(scene: Scene, result: TapResult) -> Iterator[str]:
    for name in ("kinetic_energy_J", "strain_energy_J", "contact_energy_J"):
        if getattr(result.history, name).min() < 0:
            yield f"{name} is negative"


def _gap_noise(scene: Scene, result: TapResult) -> float:
    """Round-off of the gap, plus the tip's travel in the time to which events are located, m."""
    speed = float(np.abs(result.history.tip_velocity_m_per_s).max())
    located = 2e-15 + 2e-12 * scene.settings.contact_step
    return 16 * EPS * (scene.surface.height + scene.finger.length) + located * speed


def _step_defect(result: TapResult) -> Floats:
    """How far each step's gap is off the trapezoid of its velocities, m: the step's own error."""
    h = result.history
    mean = 0.5 * (h.tip_velocity_m_per_s[:-1, 1] + h.tip_velocity_m_per_s[1:, 1])
    return np.asarray(np.abs(np.diff(h.tip_position_m[:, 1]) - np.diff(h.time_s) * mean))


def _largest(offences: Floats, result: TapResult) -> float:
    """The largest offence, or 0; leaves one out per step through chatter, which has either mode."""
    ranked = np.sort(offences)
    chatter = result.statistics.chatter_steps
    return max(float(ranked[-1 - chatter]), 0.0) if ranked.size > chatter else 0.0


def _contact_law(scene: Scene, result: TapResult) -> Iterator[str]:
    """F_n changes by -k_n du_Y over every step, is zero in flight and never pulls."""
    h, k = result.history, scene.tip.k
    normal = h.mode // 3
    stiffest = k / scene.tip.restitution**2
    fn, peak = h.normal_force_N, float(h.normal_force_N.max())
    noise = stiffest * _gap_noise(scene, result) + 1e-9 * peak
    if fn.min() < -noise:
        yield f"normal force pulls with {-fn.min():.3g} N (peak {peak:.3g} N)"
    if np.any(fn[normal == 0] != 0) or np.any(h.tangential_force_N[normal == 0] != 0):
        yield "force in flight"
    slope = np.where(normal == 1, k, stiffest)[:-1]
    inside = (normal[:-1] > 0) & (normal[1:] > 0)
    error = np.abs(np.diff(fn) + slope * np.diff(h.tip_position_m[:, 1]))[inside]
    if error.max(initial=0.0) > noise:
        yield f"normal force leaves its law by {error.max():.3g} N (peak {peak:.3g} N)"
    away = (normal[:-1] == 1) & (normal[1:] == 1)
    rise = _largest((np.diff(h.tip_position_m[:, 1]) - 2 * _step_defect(result))[away], result)
    if rise * k > noise:
        yield f"compression mode while the tip rises by {rise:.3g} m"


def _cone(scene: Scene, result: TapResult) -> Iterator[str]:
    """|F_t| <= mu F_n, and slip is dissipative: F_t V_P <= 0."""
    h, mu = result.history, scene.surface.friction
    ratio = max(scene.tip.tangential_ratio, mu / scene.tip.restitution**2)
    noise = scene.tip.k * ratio * _gap_noise(scene, result)
    excess = np.abs(h.tangential_force_N) - mu * h.normal_force_N * (1 + 1e-9)
    peak = mu * float(h.normal_force_N.max())
    if excess.max() > noise + 1e-9 * peak:
        yield f"tangential force leaves the cone by {excess.max():.3g} N (mu Fn {peak:.3g} N)"
    # where V_P passes through zero, its sign is that of the error
    slip = (h.mode % 3 == 2) & ~np.isin(h.time_s, [e.time_s for e in result.events])
    speed = float(np.abs(h.tip_velocity_m_per_s).max())
    power = (h.tangential_force_N * h.particle_velocity_m_per_s)[slip]
    if power.max(initial=0.0) > 1e-9 * peak * speed + noise * speed:
        yield f"friction drives the tip with {power.max():.3g} W"


def _dissipation(scene: Scene, result: TapResult) -> Iterator[str]:
    h = result.history
    scale = float((h.kinetic_energy_J + h.strain_energy_J + h.contact_energy_J).max())
    work = (1 + scene.surface.friction) * float(h.normal_force_N.max())
    noise = 1e-12 * scale + work * (_gap_noise(scene, result) + 2 * _step_defect(result))
    # events and steps are repeatable to Newton's tolerance
    known = noise + scene.settings.newton_tolerance * scale
    sticks = h.mode % 3 == STICK
    returned = {"friction_dissipation_J": _returned(scene, result) * (sticks[1:] | sticks[:-1])}
    for name in ("friction_dissipation_J", "restitution_dissipation_J", "material_dissipation_J"):
        allowed = known + returned.get(name, 0.0)
        if (drop := _largest(-np.diff(getattr(h, name)) - allowed, result)) > 0:
            yield f"{name} falls by {drop:.3g} J more than round-off"


def _returned(scene: Scene, result: TapResult) -> float:
    """The most that the softening of a patch that sticks gives back, J.

    -e/2 int F_n^2 d(r^2) - (1 - e*^2) e/2 F_t^2 <= (1 - e*^2/2) e (mu F_n)^2 at the largest F_n, of
    the springs' forces, which the record does not have.
    """
    law = law_of(scene.finger, scene.surface, scene.tip, scene.assumptions)
    if isinstance(law, ContactLaw):
        return 0.0
    held = law.mu * float(result.history.normal_force_N.max())
    return (1.0 - 0.5 * law.restitution**2) * law.softening * held**2


NEXT_NORMAL = {
    "contact": ("flight", "compression"),
    "compression_to_restitution": ("compression", "restitution"),
    "restitution_to_compression": ("restitution", "compression"),
    "separation": ("restitution", "flight"),
}


def _events(scene: Scene, result: TapResult) -> Iterator[str]:
    """Events follow one another as fig. 5 allows, and the first mode is that of eq. 21."""
    h, state, tangential, previous = result.history, "flight", "free", -np.inf
    for event in result.events:
        if event.time_s < previous:
            yield f"{event.kind} before its predecessor"
        previous = event.time_s
        if event.kind not in NEXT_NORMAL:
            before, after = event.kind.split("_to_")
            if tangential != before or state == "flight":
                yield f"{event.kind} while in {tangential}, {state}"
            tangential = after
            continue
        before, after = NEXT_NORMAL[event.kind]
        if state != before:
            yield f"{event.kind} while in {state}"
        state = after
        if event.kind == "contact":
            rows = np.flatnonzero((h.time_s == event.time_s) & (h.mode // 3 == 1))
            if not rows.size:
                yield "contact without a row in compression"
                continue
            tangential = ("free", "stick", "slip")[int(h.mode[rows[0]]) % 3]
            wanted = _first_mode(scene, *h.tip_velocity_m_per_s[rows[0]])
            if tangential != wanted:
                yield f"contact starts in {tangential}, eq. 21 asks for {wanted}"


def _first_mode(scene: Scene, vx: float, vy: float) -> str:
    """How a tip of that velocity, m/s, starts to touch by eq. 21."""
    mu, ratio = scene.surface.friction, scene.tip.tangential_ratio
    if mu == 0 or ratio == 0:
        return "free"
    return "stick" if abs(vx) * ratio < mu * abs(vy) else "slip"


def _postures(scene: Scene, result: TapResult) -> Iterator[str]:
    """Hinges stay closed."""
    reach = scene.finger.length
    for posture in result.event_postures:
        ends = [np.zeros(2), *(r[-1] for r in posture.positions_m[:-1])]
        gap = max(float(np.abs(a - r[0]).max())
                  for a, r in zip(ends, posture.positions_m, strict=True))  # fmt: skip
        if gap > 1e-11 * reach * max(1, result.statistics.steps) ** 0.5:
            yield f"a hinge opens by {gap:.3g} m"


def _work(scene: Scene, result: TapResult) -> Iterator[str]:
    s = result.statistics
    allowed = ITERATIONS_A_STEP * scene.settings.max_steps + 100_000
    if s.newton_iterations > allowed:
        yield f"{s.newton_iterations} Newton iterations, more than {allowed}"
    elements = sum(p.elements for p in scene.finger.phalanges)
    bound = RUN_BOUND_S + ITERATION_BOUND_S * s.newton_iterations * (elements + 5)
    if s.wall_time_s > bound:
        yield f"took {s.wall_time_s:.3g} s, more than {bound:.3g} s"

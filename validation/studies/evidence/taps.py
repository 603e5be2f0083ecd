"""The whole tap by CalculiX: the reference's mesh, impact state, hinges and contact's stiffness.

`peers.calculix_impact` says what CalculiX does differently; its steps are implicit (HHT, alpha =
-0.05) and take three or four Newton iterations each: ten minutes to an hour per tap. Its results
are therefore kept in ``validation/data`` with date and machine; ``--fresh`` runs it again.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from typing import Any

import numpy as np
from pydantic import TypeAdapter

import reference_fem as fem
from hcm.arrays import Floats
from reference_fem.elements.stress import von_mises
from reference_fem.model import build_model
from reference_fem.rigid.rigid_chain import pose
from validation import DATA
from validation.harness import identity
from validation.harness.interrupts import unless_interrupted
from validation.harness.provenance import processor
from validation.harness.quantities import quantities
from validation.harness.store import Store
from validation.models import solid_inputs, solid_mesh
from validation.models.adapter import Progress
from validation.peers import calculix, calculix_impact
from validation.scenes.load import load_scene
from validation.studies.evidence.rows import EvidenceRow

KEPT = DATA / "calculix_taps.json"
# Length of an increment. C3D8I on the soft finger with friction converges neither at 4 us nor at 2.
STEP_S = {"soft": {"C3D8": 2e-6, "C3D8I": 1.5e-6}, "hard": {"C3D8": 1e-6, "C3D8I": 1e-6}}
AFTER_S = 2e-5  # of motion after our own tap
CLEARANCE_M = 5e-6  # gap below the impact state
TIMEOUT_S = 3 * 3600.0
ENDS = 0.01  # of the peak, where a curve's duration is read
JUDGED = ("peak_normal_force_N", "normal_impulse_N_s", "contact_duration_s")
# Edges at the tip of 0.4 Hertz's radius: CalculiX takes minutes, and our errors are some percent.
MESH = ("patch_size=0", "axial_size=4e-3", "contact=surface")
EDGES = {"soft": ("tip_size=2.5e-4", "growth=1.6"), "hard": ("tip_size=1.5e-4", "growth=2")}


@dataclass(frozen=True)
class SpringTap:
    """A scene's tap with springs of the modulus factor E*/R under the surface.

    element : CalculiX', fully integrated (C3D8) or with incompatible modes (C3D8I).
    """

    scene: str
    factor: float
    friction: float = 0.5
    element: str = "C3D8"

    @property
    def ours(self) -> tuple[str, float, float]:
        """The part on which our own tap depends: all but the element."""
        return self.scene, self.factor, self.friction


@dataclass(frozen=True)
class CalculixTap:
    """CalculiX's result for a tap, with date and machine.

    time_s, normal_force_N : from the impact state, of the full body; step_s : its increment.
    von_mises_kPa : of each element's mean stress, in the increment nearest to our own peak's
        snapshot, at field_time_s from the impact state; empty if it was not kept.
    """

    tap: SpringTap
    program: str
    date: str
    machine: str
    wall_time_s: float
    step_s: float
    time_s: tuple[float, ...]
    normal_force_N: tuple[float, ...]
    field_time_s: float = 0.0
    von_mises_kPa: tuple[int, ...] = ()


@dataclass(frozen=True)
class ReferenceTap:
    """The reference's result for a tap; times are from the impact state.

    errors : absolute, by quantity. von_mises_kPa, volume_m3 : of the elements, at field_time_s.
    cut, corners_mm : the elements at the plane of symmetry, and their four corners in it.
    """

    time_s: tuple[float, ...]
    normal_force_N: tuple[float, ...]
    errors: dict[str, float]
    field_time_s: float
    von_mises_kPa: tuple[int, ...]
    volume_m3: tuple[float, ...]
    cut: tuple[int, ...]
    corners_mm: tuple[tuple[tuple[float, float], ...], ...]


STIFF = 300.0  # springs that are as good as a rigid wall
TAPS = {
    "tap-soft": SpringTap("soft", STIFF),
    "tap-soft-incompatible": SpringTap("soft", STIFF, element="C3D8I"),
    "tap-frictionless-incompatible": SpringTap("soft", STIFF, 0.0, "C3D8I"),
    "tap-hard": SpringTap("hard", STIFF),
    "tap-hard-incompatible": SpringTap("hard", STIFF, element="C3D8I"),
    "tap-soft-penalty": SpringTap("soft", 1.427),
}


@cache
def prepared(scene: str, factor: float, friction: float) -> tuple[Any, ...]:
    """The reference's tap, its model and material; the impact state's time and nodes (u, v)."""
    keys = (*MESH, *EDGES[scene], f"surface_factor={factor}")
    overrides = (*(f"solver.fem.{key}" for key in keys), f"surface.friction={friction:g}")
    tables = load_scene(scene, overrides).tables
    sizing, _ = solid_mesh.sizing_of(tables, 3)
    mesh, given = solid_mesh.build_mesh(tables, 3, sizing), solid_inputs.solid_parts(tables)
    state: Any = fem.impact_state(mesh.shape, *given[:3], CLEARANCE_M)
    beside = solid_mesh.companion(tables, 3, sizing)
    run = unless_interrupted(fem.simulate(mesh, *given, start=state, companion=beside))
    if run.status is not fem.Status.COMPLETED:
        raise ArithmeticError(run.message)
    model: Any = build_model(mesh, *given)
    posed = pose(model.chain, state, model.points, model.body_of_point)
    return run, model, given[0][-1], state.time_s, *posed


def at_peak(run: Any) -> Any:
    """The snapshot of a run at its peak force."""
    return next(one for one in run.snapshots if one.at_peak)


def reference_tap(tap: SpringTap, store: Store) -> ReferenceTap:
    """Our own tap, stored or new; it does not depend on CalculiX's element."""
    inputs = {"result": "our tap", "tap": tap.ours, "program": identity.program(__name__)}
    return store.obtain(inputs, ReferenceTap, lambda: by_reference(tap))


def by_reference(tap: SpringTap) -> ReferenceTap:
    """Solve a tap with the reference."""
    run, model, _, start_s, placed, _ = prepared(*tap.ours)
    peak = at_peak(run)
    cells, faces = calculix_impact.faces_within(model.cells, model.symmetry)
    return ReferenceTap(
        tuple((run.forces.time_s - start_s).tolist()),
        tuple(run.forces.normal_force_N.tolist()),
        {key: run.errors[key] for key in JUDGED}, peak.time_s - start_s,
        tuple((1e-3 * peak.von_mises_Pa).round().astype(int).tolist()),
        tuple(model.kernel.cell_volume.tolist()), tuple(cells),
        tuple((1e3 * (model.points + placed)[faces, :2]).round(4).tolist()),
    )  # fmt: skip


def by_calculix(tap: SpringTap) -> CalculixTap:
    """Run a tap with CalculiX; raises ArithmeticError if it fails, keeps what a stopped run has."""
    run, model, material, start_s, placed, velocity = prepared(*tap.ours)
    until = run.summary.contact_time_s + run.summary.contact_duration_s - start_s
    deck = calculix_impact.deck(
        model, material, placed, velocity, until + AFTER_S, tap.element,
        STEP_S[tap.scene][tap.element], stresses=True,
    )  # fmt: skip
    ran = calculix.run_calculix(deck, TIMEOUT_S)
    if ran.answer not in (calculix.COMPLETED, calculix.TIMED_OUT):
        raise ArithmeticError(f"CalculiX {ran.answer}")
    time, half = calculix_impact.floor_forces(ran.printed)
    at, field = calculix_impact.stress_near(ran.printed, at_peak(run).time_s - start_s)
    return CalculixTap(
        tap, f"CalculiX {calculix.version()}", f"{datetime.now(UTC):%Y-%m-%d}", processor(),
        round(ran.wall_time_s), float(time[1] - time[0]), (0.0, *time.round(9).tolist()),
        (0.0, *(model.symmetry_factor * half).round(4).tolist()), at,
        tuple((1e-3 * von_mises(field)).round().astype(int).tolist()),
    )  # fmt: skip


def kept_taps() -> dict[SpringTap, CalculixTap]:
    """The outcomes in ``validation/data``."""
    return {one.tap: one for one in TypeAdapter(list[CalculixTap]).validate_json(KEPT.read_bytes())}


def calculix_tap(tap: SpringTap, store: Store) -> CalculixTap:
    """A stored run of this machine if there is one, else the kept one, else a new one."""
    inputs = {"result": "CalculiX' tap", "tap": vars(tap), "program": identity.program(__name__)}
    wanted = store.fresh and calculix.available()
    found = store.find(inputs, CalculixTap) or (None if wanted else kept_taps().get(tap))
    return found or store.obtain(inputs, CalculixTap, lambda: by_calculix(tap))


def duration(time: Floats, force: Floats) -> float:
    """How long a curve lies above `ENDS` of its peak, s, linear between its points."""
    limit = ENDS * force.max()
    first, last = np.flatnonzero(force > limit)[[0, -1]].tolist()
    rise = np.interp(limit, force[first - 1 : first + 1], time[first - 1 : first + 1])
    fall = np.interp(-limit, -force[last : last + 2], time[last : last + 2])
    return float(fall - rise)


def numbers_of(tap: ReferenceTap | CalculixTap) -> dict[str, float]:
    """The judged numbers of a force curve; only the peak of one that was stopped in contact."""
    time, force = np.array(tap.time_s), np.array(tap.normal_force_N)
    found = [float(force.max())]
    if force[-1] == 0.0:
        impulse = float(np.trapezoid(force, time))
        found += [impulse, duration(time, force)]
    return dict(zip(JUDGED, found, strict=False))


def shares(tap: SpringTap, store: Store) -> dict[str, float]:
    """Relative errors of our tap due to its mesh: those on stiff springs.

    Springs are given, and the same in both programs: the effect of softer ones is not an error.
    """
    own = reference_tap(replace(tap, factor=STIFF), store)
    return {key: own.errors[key] / abs(value) for key, value in numbers_of(own).items()}


def rows(tap: SpringTap, progress: Progress, store: Store) -> Iterator[EvidenceRow]:
    """Peak, impulse, duration and field of stress; the mesh, which they share, errs alike in both.

    A run that was stopped in contact has only its peak and the field there. The field's relative
    error is taken to be the peak's.
    """
    progress(0.0, f"the {tap.scene} tap by CalculiX and the reference")
    theirs, own = calculix_tap(tap, store), reference_tap(tap, store)
    time, force = np.array(theirs.time_s), np.array(theirs.normal_force_N)
    apart = (np.interp(time, own.time_s, own.normal_force_N) - force)[force > 0.0]
    rms = 100.0 * float(np.sqrt(np.mean(apart**2)) / force.max())
    numbers, own_numbers, share = numbers_of(theirs), numbers_of(own), shares(tap, store)
    stopped = (
        f"; CalculiX was stopped at {1e6 * time[-1]:.3g} us, still in contact at {force[-1]:.4g} N:"
        " it has no impulse and no duration"
    ) * bool(force[-1])
    by = (
        f"{force.max():.4g} and {max(own.normal_force_N):.4g} N; RMS of the curve {rms:.2g} %;"
        f" {theirs.program} on {theirs.date}, {theirs.machine}, {theirs.wall_time_s / 60:.0f} min,"
        f" steps of {1e6 * theirs.step_s:g} us{stopped}"
    )
    for of in quantities(*numbers):
        outside, ours = (of.factor * by_key[of.key] for by_key in (numbers, own_numbers))
        error = share[of.key]
        known = error * abs(outside), ours, error * abs(ours)
        remark = by if of.key == JUDGED[0] else ""
        yield EvidenceRow(of.title, of.unit, "fem3d", outside, *known, remark)
    if theirs.von_mises_kPa:
        *sizes, apart = fields(theirs, own)
        outside, ours = (1e-6 * size for size in sizes)
        error = share[JUDGED[0]]
        known = error * outside, ours, error * ours
        name = "von Mises' stress at the peak, RMS over the body"
        remark = f"the fields differ by {100 * apart:.2g} % of it"
        yield EvidenceRow(name, "MPa", "fem3d", outside, *known, remark)


def fields(theirs: CalculixTap, own: ReferenceTap) -> tuple[float, float, float]:
    """Von Mises' stress over the body, sqrt(∫ s² dV / V), Pa: theirs, ours, and ours less theirs.

    The last one is relative to the first.
    """
    share = np.array(own.volume_m3) / sum(own.volume_m3)
    other, mine = (1e3 * np.array(of.von_mises_kPa) for of in (theirs, own))
    size, its, apart = (float(np.sqrt(share @ of**2)) for of in (other, mine, mine - other))
    return size, its, apart / size


def title(tap: SpringTap) -> str:
    """A tap in words."""
    smooth = "" if tap.friction else ", no friction"
    return f"The {tap.scene} finger's tap{smooth}, springs {tap.factor:g} E*/R"


def words(tap: SpringTap) -> dict[str, str]:
    """What fills in the texts of a tap's piece."""
    count, edge = {"soft": ("3,576", "0.25"), "hard": ("3,356", "0.15")}[tap.scene]
    start = "impact state and masses"
    if tap.factor < STIFF or not tap.friction:
        start += (
            " (the kept run is of before ours had the true shape's mass: 0.9 % lighter and 0.5 %"
            " slower)"
        )
    penalty = " So soft a spring is what a penalty of LS-DYNA's kind is on a coarse mesh."
    return {
        "title": title(tap), "element": tap.element, "count": count, "edge": edge, "start": start,
        "penalty": penalty * (tap.factor < STIFF),
    }  # fmt: skip

"""The whole tap by CalculiX: the reference's mesh, impact state, hinges and contact's stiffness.

What CalculiX does otherwise stands in `peers.calculix_impact`; its steps are implicit (HHT, alpha =
-0.05) and take three or four Newton iterations each: ten minutes a tap. So its outcome is kept in
``validation/data`` with date and machine; ``--fresh`` runs it again.
"""

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.harness import identity
from validation.harness.figures import BLUE, ORANGE, panels
from validation.harness.provenance import processor
from validation.harness.quantities import quantities, unit_of
from validation.harness.store import Store, json_format
from validation.models import solid
from validation.models.adapter import Progress
from validation.peers import calculix, calculix_impact
from validation.scenes.load import load_scene
from validation.studies.evidence.rows import Piece, Row

Floats = NDArray[np.float64]
KEPT = Path(__file__).parents[2] / "data" / "calculix_taps.json"
STEP_S = {"soft": 4e-6, "hard": 1e-6}  # of an increment
AFTER_S = 2e-5  # of motion after our own tap
CLEARANCE_M = 5e-6  # below the impact state
TIMEOUT_S = 3 * 3600.0
ENDS = 0.01  # of the peak, where a curve's duration is read
ELEMENT = "C3D8"
# Edges of 0.25 mm at the tip, and what follows from that, which CalculiX solves in minutes.
MESH = ("tip_size=2.5e-4", "patch_size=0", "growth=1.6", "axial_size=4e-3", "contact=surface")


@dataclass(frozen=True)
class Tap:
    """A scene's tap with springs of the modulus factor E*/R under the surface."""

    scene: str
    factor: float
    friction: float = 0.5


@dataclass(frozen=True)
class Outcome:
    """What CalculiX made of a tap, and where.

    time_s, normal_force_N : from the impact state, of the full body; step_s : of its increments.
    """

    tap: Tap
    program: str
    date: str
    machine: str
    wall_time_s: float
    step_s: float
    time_s: tuple[float, ...]
    normal_force_N: tuple[float, ...]
    peak_stress_R_Pa: float


TAPS = {
    "tap-soft": Tap("soft", 300.0),
    "tap-hard": Tap("hard", 300.0),
    "tap-soft-penalty": Tap("soft", 1.427),
}


@cache
def prepared(tap: Tap) -> tuple[Any, Any, Any, Any]:
    """The reference's tap and its model, the impact state, and the scene's material."""
    import reference_fem as fem
    from reference_fem.model import build_model

    keys = (*MESH, f"surface_factor={tap.factor}")
    overrides = (*(f"solver.fem.{key}" for key in keys), f"surface.friction={tap.friction:g}")
    tables = load_scene(tap.scene, overrides).tables
    sizing = solid.sizing_of(tables, 3)
    mesh, given = solid.build_mesh(tables, 3, sizing), solid.inputs(tables)
    state = fem.impact_state(mesh, *given[:3], CLEARANCE_M)
    beside = solid.companion(tables, 3, sizing)
    run = fem.simulate(mesh, *given, start=state, companion=beside)
    if run.status is not fem.Status.COMPLETED:
        raise ArithmeticError(run.message)
    return run, build_model(mesh, *given), state, given[0][-1]


def by_calculix(tap: Tap) -> Outcome:
    """Run it; an ArithmeticError says how it failed. One that was stopped keeps what it has."""
    from reference_fem.rigid_chain import pose

    run, model, state, material = prepared(tap)
    placed, velocity = pose(model.chain, state, model.points, model.body_of_point)
    until = run.summary.contact_time_s + run.summary.contact_duration_s - state.time_s
    deck = calculix_impact.deck(
        model, material, placed, velocity, until + AFTER_S, ELEMENT, STEP_S[tap.scene], "U"
    )
    ran = calculix.run_calculix(deck, TIMEOUT_S)
    if ran.answer not in (calculix.COMPLETED, calculix.TIMED_OUT):
        raise ArithmeticError(f"CalculiX {ran.answer}")
    time, half = calculix_impact.floor_forces(ran.printed)
    stress = [
        model.probe.read(model.kernel, placed + moved, np.zeros_like(placed))
        for moved in calculix.vectors(ran.printed, "displacements (vx,vy,vz)")
    ]
    return Outcome(
        tap, f"CalculiX {calculix.version()}", f"{datetime.now(UTC):%Y-%m-%d}", processor(),
        round(ran.wall_time_s), STEP_S[tap.scene], (0.0, *time.round(9).tolist()),
        (0.0, *(model.copies * half).round(4).tolist()), max(stress, key=abs),
    )  # fmt: skip


def kept() -> dict[Tap, Outcome]:
    """The outcomes in ``validation/data``."""
    from pydantic import TypeAdapter

    rows = json.loads(KEPT.read_text(encoding="utf-8"))
    return {one.tap: one for one in TypeAdapter(list[Outcome]).validate_python(rows)}


def outcome_of(tap: Tap, store: Store) -> Outcome:
    """A run of this machine if there is one, else the kept one, else a new one."""
    inputs = {"result": "CalculiX' tap", "tap": vars(tap), "program": identity.program(__name__)}
    form = json_format(Outcome)
    found = store.load(inputs, form.read) or (None if store.fresh else kept().get(tap))
    return found or store.obtain(inputs, form, lambda: by_calculix(tap))


def duration(time: Floats, force: Floats) -> float:
    """How long a curve lies above `ENDS` of its peak, s, linear between its points."""
    limit = ENDS * force.max()
    above = np.flatnonzero(force > limit)
    first, last = int(above[0]), int(above[-1])
    rise = np.interp(limit, force[first - 1 : first + 1], time[first - 1 : first + 1])
    fall = np.interp(-limit, -force[last : last + 2], time[last : last + 2])
    return float(fall - rise)


def rows(tap: Tap, progress: Progress, store: Store) -> list[Row]:
    """Peak, impulse, duration and stress at R; the mesh, which they share, errs alike in both.

    Of a run that was stopped in contact, its peak.
    """
    progress(0.0, f"the {tap.scene} tap by CalculiX and the reference")
    theirs = outcome_of(tap, store)
    run, _, state, _ = prepared(tap)
    time, force = np.array(theirs.time_s), np.array(theirs.normal_force_N)
    own_time, own = run.forces.time_s - state.time_s, run.forces.normal_force_N
    apart = (np.interp(time, own_time, own) - force)[force > 0.0]
    rms = 100.0 * float(np.sqrt(np.mean(apart**2)) / force.max())
    numbers: dict[str, tuple[float, float, str]] = {
        "peak_normal_force_N": (force.max(), own.max(), f"RMS of the curve {rms:.2g} % of it")
    }
    if force[-1] == 0.0:
        stress = theirs.peak_stress_R_Pa, run.summary.peak_stress_R_Pa
        numbers |= {
            "normal_impulse_N_s": (np.trapezoid(force, time), np.trapezoid(own, own_time), ""),
            "contact_duration_s": (duration(time, force), duration(own_time, own), ""),
            "peak_stress_R_Pa": (*stress, ""),
        }
    by = (
        f"{theirs.program} on {theirs.date}, {theirs.machine}, {theirs.wall_time_s / 60:.0f} min,"
        f" steps of {1e6 * theirs.step_s:g} us, printed every {1e6 * (time[1] - time[0]):g}"
    )
    found = []
    for of in quantities(*numbers):
        outside, ours, remark = numbers[of.key]
        error = run.errors[of.key]
        known = error * abs(float(outside / ours)), float(ours), error
        found.append(Row(of.title, unit_of(of.key), "fem3d", float(outside), *known, remark or by))
    return found


def draw(path: Path, store: Store) -> None:
    """The forces of all taps that there are, by both programs."""
    with panels(path, len(TAPS), width=3.4, height=2.8) as axes:
        for axis, tap in zip(axes[0], TAPS.values(), strict=True):
            theirs, (run, _, state, _) = outcome_of(tap, store), prepared(tap)
            micro = 1e6 * (run.forces.time_s - state.time_s)
            axis.plot(micro, run.forces.normal_force_N, color=BLUE, label="fem3d")
            micro = 1e6 * np.array(theirs.time_s)
            axis.plot(micro, theirs.normal_force_N, "--", color=ORANGE, label=theirs.program)
            axis.set_title(f"{tap.scene}, springs {tap.factor:g} E*/R", fontsize=9, loc="left")
            axis.set_xlabel("time (us)")
        axes[0][0].set_ylabel("normal force (N)")
        axes[0][0].legend()


def _piece(name: str, tap: Tap) -> Piece:
    penalty = (
        " So soft a spring is what a penalty of LS-DYNA's kind is on a coarse mesh: it takes a"
        " quarter of the peak by both programs, and the paper's 64 N lies there."
    )
    return Piece(
        name, f"The {tap.scene} finger's tap by CalculiX, springs of {tap.factor:g} E*/R", "tap",
        f"CalculiX (G. Dhondt, K. Wittig), {ELEMENT}, implicit, run for this page",
        "The same 3,576 half-model hexahedra, impact state, hinges and springs under the surface;"
        " fully integrated elements, consistent mass, facets in the place of the round surface."
        " Both errors are those of mesh and springs, which the reference states."
        + penalty * (tap.factor < 10.0),
        (__name__,), partial(rows, tap), data=(KEPT,),
    )  # fmt: skip


PIECES = tuple(_piece(name, tap) for name, tap in TAPS.items())

"""``fingertap stress --peers``: hard cells of the reference, and CalculiX' automatic step on them.

Both have the same mesh, law, contact pressure and friction (`validation.peers.calculix_impact`). An
impulse is the time integral of the normal force until the reference's run ends; it is checked by
the momentum that the body gained, which is not computed from the force, by the kinetic energy that
is left, and by 2 m v where a block falls flat without bulging.

A stiff pressure on a coarse mesh gives spikes, marked where the reference cautions about them. The
tilted block of 4 elements per edge peaks at 32.9 N with a pressure of factor 100: its lumped masses
hit springs, as the peak falls to 20.0 N with 8 elements per edge, 16.4 N with 12. CalculiX, whose
mass is consistent, gives 18 N on 4 elements, 27 N with increments below 3 µs, which do not skip its
second hit. With a pressure ten times softer, both peaks agree to 3 %.
"""

import time
from dataclasses import replace
from typing import Any

import numpy as np

import reference_fem as rf
from reference_fem.arrays import Array
from reference_fem.model import Model
from validation.harness.interrupts import unless_interrupted
from validation.models.adapter import Progress
from validation.peers import calculix, calculix_impact
from validation.studies.stress.reference.judge import bar_impulse, judge
from validation.studies.stress.reference.scene import SIDE, ReferenceScene

ABSENT = "CalculiX is not installed (apt-get install calculix-ccx): its table is skipped"
TIMEOUT_S = 40.0
# Duration of CalculiX's motion, in transits of a bar's wave: where the reference stopped, twice the
# slowest completed tap; for a bar that falls flat, twice its contact.
TRANSITS, BAR_TRANSITS = 30.0, 4.0
# Results and their formats: impulse by the forces; the share of the momentum gained from the
# surface that the impulse does not explain; final over initial kinetic energy; peak force.
IMPULSE, OPEN, KINETIC, PEAK = "impulse (N s)", "momentum open (%)", "kinetic left (%)", "peak (N)"
COLUMNS = {IMPULSE: ".4g", OPEN: ".2g", KINETIC: ".3g", PEAK: ".4g"}

_EASY = ReferenceScene(contact="surface", friction=0.0, slide=0.0, stiffness=1e-3)
_STIFF = replace(_EASY, stiffness=0.1)
CELLS: dict[str, ReferenceScene] = {
    "soft pressure: the same problem": _EASY,
    "ν 0.499": replace(_EASY, poisson=0.499, modulus=1e8, speed=10.0),
    "50 m/s, E 1e8 Pa": replace(_EASY, speed=50.0, modulus=1e8),
    "50 m/s, E 1e7 Pa: elements invert": replace(_EASY, speed=50.0),
    "stiff pressure, tilted": _STIFF,
    "stiff pressure, flat bar": replace(_STIFF, tilt=0.0, poisson=0.0),
    "stiffest pressure": replace(_EASY, stiffness=10.0),
    "friction 0.3, soft pressure": replace(_EASY, friction=0.3, slide=0.5),
    "friction 10, stiff pressure": replace(_STIFF, friction=10.0, slide=0.5),
}


def impulse_balance(
    force: Array, time_s: Array, velocity: Array, scene: ReferenceScene, model: Model
) -> dict[str, float]:
    """`COLUMNS` of a full body, from the surface's force on it and its nodes' last velocities.

    The momentum is Σ m (v_y + v - f_y t) of a block that fell at v.
    """
    mass = model.symmetry_factor * model.mass
    impulse = float(np.trapezoid(force, time_s))
    gained = float(mass @ (velocity[:, 1] + scene.speed - model.gravity_vector[1] * time_s[-1]))
    before = mass.sum() * scene.speed**2 * (1.0 + scene.slide**2)
    kinetic = float(mass @ (velocity**2).sum(axis=1) / before)
    values = impulse, 100 * abs(impulse / gained - 1.0), 100 * kinetic, float(force.max())
    return dict(zip(COLUMNS, values, strict=True))


def calculix_deck(scene: ReferenceScene, model: Model, displacement: Array, end_s: float) -> str:
    """The cell's block as CalculiX' input, from its start to `end_s`."""
    velocity = np.tile([scene.slide * scene.speed, -scene.speed, 0.0], (len(model.points), 1))
    return calculix_impact.deck(model, scene.material, displacement, velocity, end_s)


def calculix_balance(
    scene: ReferenceScene, ran: calculix.CalculixRun, model: Model
) -> dict[str, float] | None:
    """`COLUMNS` of CalculiX's run; None if unfinished, as part of the motion has less impulse."""
    velocity = calculix_impact.last_velocities(ran.printed)
    if ran.answer != calculix.COMPLETED or velocity is None:
        return None
    time_s, half = calculix_impact.floor_forces(ran.printed)
    force = np.append(0.0, model.symmetry_factor * half)
    return impulse_balance(force, np.append(0.0, time_s), velocity, scene, model)


def _own_balance(scene: ReferenceScene, result: rf.TapResult, model: Model) -> dict[str, float]:
    f, last = result.forces, result.snapshots[-1]
    rows = f.time_s <= last.time_s + 0.5 * model.step_s
    return impulse_balance(f.normal_force_N[rows], f.time_s[rows], last.velocity, scene, model)


def _texts(balance: dict[str, float] | None) -> dict[str, str]:
    return {key: f"{balance[key]:{form}}" if balance else "" for key, form in COLUMNS.items()}


def compare_cell(name: str, scene: ReferenceScene) -> dict[str, Any]:
    """Solve a cell by both programs; returns a row of the table."""
    start_s = time.perf_counter()
    result, model = scene.simulate()
    unless_interrupted(result)
    seconds = time.perf_counter() - start_s
    completed = result.status is rf.Status.COMPLETED
    start, last = result.snapshots[0], result.snapshots[-1]
    transit = SIDE / scene.material.bar_speed
    limit = bar_impulse(scene, model)
    end = last.time_s if completed else TRANSITS * transit
    if limit is not None:
        end = max(end, BAR_TRANSITS * transit)
    deck = calculix_deck(scene, model, start.displacement, end)
    ran = calculix.run_calculix(deck, TIMEOUT_S)
    verdict = judge(scene)
    answer = str(verdict.answer) if completed else f"{verdict.answer}: {result.status.value}"
    own = _texts(_own_balance(scene, result, model) if completed else None)
    if completed and any("spike" in caution for caution in result.cautions):
        own[PEAK] += " (spike)"
    ours = {"answer": answer, **own, "wall (s)": f"{seconds:.2g}"}
    theirs = {"answer": ran.answer, **_texts(calculix_balance(scene, ran, model)),
              "increments": len(calculix_impact.floor_forces(ran.printed)[0]),
              "wall (s)": f"{ran.wall_time_s:.2g}"}  # fmt: skip
    return {
        "cell": name,
        **{f"ours: {key}": value for key, value in ours.items()},
        **{f"CalculiX: {key}": value for key, value in theirs.items()},
        "2 m v (N s)": "" if limit is None else f"{limit:.4g}",
    }


def calculix_table(progress: Progress) -> list[dict[str, Any]]:
    """One row per cell; empty if CalculiX is not installed."""
    if not calculix.available():
        return []
    unless_interrupted(_EASY.simulate()[0])  # loads the compiled kernels: not timed
    rows = []
    for number, (name, scene) in enumerate(CELLS.items()):
        progress(number / len(CELLS), f"CalculiX, {name}")
        rows.append(compare_cell(name, scene))
    return rows

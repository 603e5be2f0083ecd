"""Exudyn as a model: this module is its `validation.models.adapter.Adapter` (extra ``bench``).

The finger of `peers.exudyn_finger` falls undriven and slides in +X throughout its tap. Whether a
scene slides is not known beforehand: a run whose tip sticks or turns back fails and says so.
"""

import time

from validation.errors import RunFailedError
from validation.harness.provenance import installed
from validation.models.adapter import Checkpoint, Kind, Outcome, Progress
from validation.models.curves import Curves, record_of
from validation.models.hcm import hcm_scene
from validation.models.impact import impact_of
from validation.peers.exudyn_finger import PeerFailedError, tap
from validation.scenes.load import NamedScene, load_scene

name = "exudyn"
kind: Kind = "reduced"
settings = ""
resumable = False
sources: tuple[str, ...] = (__name__,)
independent_of: tuple[str, ...] = ("reference_fem", "meshes")

# Within 1e-4 of its own converged peak on the soft finger, as the benchmark's tables show.
FLIGHT_STEP_S, CONTACT_STEP_S = 1e-4, 5e-7
SHORTLY_BEFORE = 0.98  # share of a rigid finger's fall after which Exudyn looks for contact


def refusal(scene: NamedScene) -> str:
    """Why it can't take this scene, with the remedy; empty if it can."""
    tables = scene.tables
    if not installed(name):
        return "exudyn is not installed: pip install 'fingertap[bench]'"
    if tables.tip.normal_stiffness is None:
        return "tip.normal_stiffness is missing: Exudyn's finger taps on a spring of that k"
    elsewhere = any(map(any, tables.start_state or ()))
    for key, value, needed in (
        ("drive.torques other than 0", any(map(any, tables.torque_rows)), False),
        ("surface.incline", tables.surface.incline, 0.0),
        ("a start other than level and at rest", elsewhere, False),
        ("tip.restitution", tables.tip.restitution, 1.0),
        ("surface.friction = 0", tables.surface.friction > 0.0, True),
    ):
        if value != needed:
            taken = "only undriven, elastic, sliding taps from rest along -X"
            given = f"{key} = {value:g}" if isinstance(needed, float) else key
            return f"exudyn takes {taken}: {given}; use --model hcm"
    return ""


def warm_up() -> None:
    """Tap once with two elements per phalanx, which loads the library."""
    run(load_scene("soft", ("finger.elements=2",)))


def run(
    scene: NamedScene, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> Outcome:
    """Fall and tap; a run cannot be resumed, and Exudyn reports no progress."""
    del progress, checkpoint
    given = hcm_scene(scene, estimate=False)
    until = SHORTLY_BEFORE * impact_of(scene).time_s
    start = time.perf_counter()
    try:
        found = tap(given, FLIGHT_STEP_S, CONTACT_STEP_S, True, until)
    except PeerFailedError as error:
        raise RunFailedError(f"scene {scene.name}, model {name}: {error}") from error
    wall_time = time.perf_counter() - start
    forces = found.normal_force_N, -scene.tables.surface.friction * found.normal_force_N
    its = found.quantities
    scalars = {
        "contact_time_s": its.contact_time_s,
        "tip_velocity_at_contact_m_per_s": found.tip_velocity_m_per_s,
        "peak_normal_force_N": its.peak_normal_force_N,
        "peak_normal_force_time_s": its.turn_s,
        "contact_duration_s": its.duration_s,
        "normal_impulse_N_s": its.normal_impulse_N_s,
        "steps": found.steps,
    }
    record = record_of(Curves(found.time_s, *forces, scalars), scene, name, wall_time_s=wall_time)
    return Outcome(record)

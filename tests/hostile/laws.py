"""What the numbers of a completed run have to obey, whatever the scene."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from validation.scenes.scene import Scene

ROUND_OFF = 1e-9
SAMPLED = 1e-3  # of an impulse or peak from the history against the solver's own
AUDITED = 0.1  # of the largest kinetic energy: the solvers' own limit of their balance
POSITIVE = (
    "peak_normal_force_N", "contact_duration_s", "normal_impulse_N_s", "contact_time_s",
    "wall_time_s", "peak_memory_MB", "steps",
)  # fmt: skip
ENERGIES = ("kinetic", "strain", "gravity", "contact")

Run = dict[str, Any]


def printed(text: str) -> Run:
    """The object that a run prints; a ValueError where it is no strict JSON."""

    def refuse(name: str) -> None:
        raise ValueError(f"{name} in JSON")

    run: Run = json.loads(text, parse_constant=refuse)
    return run


def broken(run: Run, scene: Scene, history: Path) -> list[str]:
    """The laws that a completed run breaks: its scalars, as `printed`, and its ``history.nc``."""
    missing = [key for key in POSITIVE if not (run.get(key) or 0) > 0]
    if missing:
        return [f"completed with {key} = {run.get(key)!r}" for key in missing]
    peak, duration, impulse = (run[key] for key in POSITIVE[:3])
    slack = 1 + 1e-6
    found = {
        "no speed at contact": not math.hypot(*run["tip_velocity_at_contact_m_per_s"]) > 0,
        "the peak comes after the end": not 0 <= run["peak_normal_force_time_s"] <= duration,
        "impulse above peak times duration": impulse > slack * peak * duration,
        "the first peak is above the peak": (run["first_peak_normal_force_N"] or 0) > slack * peak,
        "outside of Coulomb's cone": abs(run["peak_tangential_force_N"])
        > scene.surface.friction * peak * (1 + SAMPLED),
        "energy is not balanced": not 0 <= run["energy_residual"] <= AUDITED,
    }
    for key, error in run["error_estimates"].items():  # what is infinite is null in JSON
        parts = error if isinstance(error, list) else [error]
        found[f"an estimate {key} = {error}"] = key not in run or not all(
            part is None or part >= 0 for part in parts
        )
    with h5py.File(history) as file:
        over = [file[name].shape for name in ("time_s", "step_time_s") if name in file]
        rows = {name: array[()] for name, array in file.items() if array.shape[:1] in over}
        found |= _of_history(rows, run, scene)
    return [what for what, is_so in found.items() if is_so]


def _of_history(rows: Mapping[str, Any], run: Run, scene: Scene) -> dict[str, bool]:
    step = "step_" if "step_time_s" in rows else ""  # every step's forces, or more
    time, normal = rows[step + "time_s"], rows[step + "normal_force_N"]
    peak, start = run["peak_normal_force_N"], run["contact_time_s"]
    end = start + run["contact_duration_s"]
    tap, sampled = (
        (of >= start * (1 - ROUND_OFF)) & (of <= end * (1 + ROUND_OFF))
        for of in (time, rows["time_s"])
    )
    numbers = [array for array in rows.values() if array.dtype.kind == "f"]
    if not tap.any() or not all(np.isfinite(array).all() for array in numbers):
        return {"a history that is not finite, or without the tap": True}
    if step:  # a touch, and its end, lie between two of a solid's steps
        tap |= np.convolve(tap, [True] * 3, "same")
    least = -1e-6 * rows["kinetic_energy_J"].max()
    integral = np.trapezoid(normal[tap], time[tap]) if step else _integral(time[tap], normal[tap])
    found = {
        "time runs back": (np.diff(time) < 0).any(),
        "the surface pulls": min(normal.min(), rows["normal_force_N"].min()) < -1e-6 * peak,
        "another peak than in the history": abs(normal[tap].max() / peak - 1) > SAMPLED,
        "another impulse than the force's integral": abs(integral / run["normal_impulse_N_s"] - 1)
        > SAMPLED,
        "energy below zero": any((rows[f"{n}_energy_J"] < least).any() for n in ENERGIES[:2]),
    }
    if run["model"] == "hcm":
        history = {name: rows[name][sampled] for name in rows if len(rows[name]) == len(sampled)}
        found |= _of_beams(history, scene)
    return {what: bool(is_so) for what, is_so in found.items()}


def _integral(time: NDArray[np.float64], force: NDArray[np.float64]) -> float:
    """Of samples of long steps by monotone cubics: a chord leaves out 1e-3 of the hard tap."""
    later = np.append(np.diff(time) > 0, True)  # a step's end and an event may coincide
    if later.sum() < 2:
        return 0.0
    return float(PchipInterpolator(time[later], force[later]).integrate(time[0], time[-1]))


def _of_beams(rows: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Laws of the reduced model's tap.

    The contact gives back no more than it took: ∫ F·v dt <= 0. The body's momentum, whose change is
    ∫ (F - R) dt - m g Δt with the force R on the fixed hinge, is at most sqrt(2 m T), T the kinetic
    energy. Energy held and lost, less the drive's work, stays.
    """
    finger, time = scene.finger, rows["time_s"]
    columns = finger.length, finger.diameter, scene.material.density
    mass = sum(math.pi / 4 * length * d**2 * density for length, d, density in scene.rows(*columns))
    force = np.column_stack([rows["tangential_force_N"], rows["normal_force_N"]])
    kinetic, net = rows["kinetic_energy_J"], force - rows["hinge_reactions_N"][:, 0]
    impulse = np.trapezoid(net, time, axis=0)
    impulse[1] -= mass * scene.drive.gravity * (time[-1] - time[0])
    held = sum(rows[f"{name}_energy_J"] for name in ENERGIES)
    lost = sum(rows[f"{cause}_dissipation_J"] for cause in ("friction", "restitution", "material"))
    work = np.trapezoid((force * rows["tip_velocity_m_per_s"]).sum(1), time)
    largest = np.sqrt(2 * mass * kinetic[[0, -1]]).sum()
    summed = np.trapezoid(np.abs(net).max(1), time)
    return {
        "the contact gives energy": work > 1e-2 * kinetic.max(),
        "momentum without a force": np.linalg.norm(impulse) > largest + 1e-2 * summed,
        "energy from nothing": np.ptp(held + lost - rows["drive_work_J"]) > AUDITED * kinetic.max(),
    }  # fmt: skip

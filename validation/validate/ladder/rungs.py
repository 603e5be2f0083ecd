"""Rungs 2, 3 and 4: structure, contact, the paper; the causes of rung 3's difference."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from validation.compare.differences import error_percent, spread
from validation.compare.force_curves import FORCES
from validation.compare.grid_convergence import convergence
from validation.compare.iso18571 import rate_forces
from validation.compare.sprague_geers import compare_forces
from validation.harness.quantities import COMPARED, OF_A_TAP, OF_THE_FLIGHT, Quantity
from validation.harness.record import RunRecord
from validation.identify.contact import ContactIdentification
from validation.models import estimate_override
from validation.models.impact import Impact
from validation.scenes.load import NamedScene, load_scene
from validation.validate.ladder.runs import (
    Contact,
    LadderRuns,
    full_contact,
    lumped_solid,
    reduced,
    scene_contact,
)
from validation.validate.plan import NO_FEM_ACCURACY, PAPER_REDUCED, PAPER_REFERENCE, Runs

SAME, OWN = "same impact", "own flight"  # where the two models start
# Edges of section and axis over the diameter, coarse to fine: 15 mm gives 2.25, 1.5, 1.2 mm.
STRUCTURE = ((0.15, 0.2), (0.1, 0.133), (0.08, 0.107))
STRUCTURE_FULL = ((0.1, 0.133), (0.067, 0.089), (0.05, 0.067))
# Edge at the contact over the diameter, growth, edges of section and axis; coarse to fine.
CONTACT = ((0.0267, 1.6, 0.1, 0.167), (0.0133, 1.4, 0.1, 0.167))
CONVERGED = 0.008  # edge at the contact over the diameter, in the preset `converged`
CONTACT_FULL = (CONTACT[-1], (0.0094, 1.3, 0.085, 0.12), None)  # None: the preset
ORDER = 2.0  # of the trilinear elements
EXPERIMENT = (0.1, 0.133)  # the solid's edges of section and axis over the diameter
HERTZ = "Hertz's law of the same energy instead of the linear spring"
CAUSE_COLUMNS = ("scene", "step", "peak_N", "duration_us", "impulse_mN_s")


@dataclass(frozen=True)
class Comparison:
    """A compared number.

    rung : 2, 3 or 4.
    quantity : name, unit and start.
    reduced, reference, reference_uncertainty : in the quantity's unit; None where there is none.
    error_percent : of the reduced model against the reference.
    """

    rung: int
    scene: str
    quantity: str
    reduced: float | None
    reference: float | None
    reference_uncertainty: float | None
    error_percent: float | None


def name_of(entry: Quantity, start: str) -> str:
    """A quantity's name in the column ``quantity``."""
    return f"{entry.title} ({entry.unit}), {start}"


def compare_runs(
    rung: int,
    reduced: RunRecord,
    reference: RunRecord,
    uncertainty: Mapping[str, float],
    start: str,
) -> list[Comparison]:
    """All compared scalars and the curves' metrics.

    uncertainty : relative uncertainties of the reference, by key; else it is what the run states.
    start : SAME or OWN.
    """
    scene = reduced.scene
    found = []
    for entry in COMPARED:
        value, target = entry.read(reduced), entry.read(reference)
        # what a common impact state fixes for both models says nothing about them
        if (start == SAME and entry in OF_THE_FLIGHT) or (value is None and target is None):
            continue
        share = uncertainty.get(entry.key)
        known = entry.error(reference) if share is None or target is None else share * abs(target)
        error = error_percent(value, target)
        found.append(Comparison(rung, scene, name_of(entry, start), value, target, known, error))
    for name, title in FORCES.items():
        metrics = compare_forces(reduced, reference, name)
        for part, share in zip("MPC", metrics or (), strict=metrics is not None):
            text = f"Sprague-Geers {part} of {title} (%), {start}"
            found.append(Comparison(rung, scene, text, None, None, None, 100 * share))
        rating = rate_forces(reduced, reference, name)
        if rating is not None:
            text = f"ISO/TS 18571 rating of {title} ({rating.grade}), {start}"
            lost = 100 * (rating.overall - 1)
            found.append(Comparison(rung, scene, text, rating.overall, 1.0, None, lost))
    return found


def uncertainties(sizes: Sequence[float], records: Sequence[RunRecord]) -> dict[str, float]:
    """Relative uncertainty of the finest run's tap by key: index or spread (see `convergence`), and
    at least the error that it states: two meshes may agree by chance. All meshes fly alike.
    """
    found = {}
    for entry in COMPARED:
        if entry in OF_THE_FLIGHT:
            continue
        values = [value for record in records if (value := entry.read(record)) is not None]
        if len(values) != len(records) or not values[-1]:
            continue
        share = (entry.error(records[-1]) or 0.0) / abs(values[-1])
        if len(values) > 2:
            share = max(share, convergence(sizes, values, ORDER).uncertainty)
        elif len(values) > 1:
            share = max(share, abs((values[-1] - values[-2]) / values[-1]))
        found[entry.key] = share
    return found


def structure_rung(
    scene: NamedScene, impact: Impact, full: bool, runs: LadderRuns
) -> list[Comparison]:
    """Rung 2: the scene's lumped law on both bodies, the solid's end being flat."""
    contact = scene_contact(scene)
    meshes = STRUCTURE_FULL if full else STRUCTURE
    rows = []
    for name, start in ((SAME, impact), (OWN, None)):
        records = [runs.obtain(lumped_solid, scene, contact, start, edges) for edges in meshes]
        # whole numbers of elements across the section: its edges are not those asked for
        sizes = [record.summary["elements"] ** (-1 / 3) for record in records]
        share = uncertainties(sizes, records)
        beams = runs.obtain(reduced, scene, contact, start)
        rows += compare_runs(2, beams, records[-1], share, name)
    return rows


def contact_rung(
    source: str,
    scene: NamedScene,
    impact: Impact,
    found: ContactIdentification,
    stored: dict[str, float],
    full: bool,
    runs: LadderRuns,
) -> tuple[list[Comparison], RunRecord, RunRecord, RunRecord]:
    """Rung 3: the reduced model with identified k and eta^2 against the solid's own contact.

    stored : relative uncertainties of the preset `converged` by key, where a study has them.

    Returns
    -------
    The rows, and the finest runs: of the reference from the common impact, of the reference and
    of the reduced model each from its own flight.
    """
    contact = Contact(found.normal_stiffness_N_per_m, 1 / found.eta_squared)
    diameter = scene.tables.smallest_diameter
    meshes = CONTACT_FULL if full else CONTACT
    settings = [mesh_keys(mesh, diameter) for mesh in meshes]
    # only the finest mesh's errors are asked for: the others are judged by their differences
    plain = estimate_override("fem3d")
    meshed = [(load_scene(source, [*keys, *plain]), name) for keys, name in settings[:-1]]
    meshed += [(load_scene(source, keys), name) for keys, name in settings[-1:]]
    records = [runs.obtain(full_contact, finer, impact, name) for finer, name in meshed]
    sizes = [CONVERGED if mesh is None else mesh[0] for mesh in meshes]
    # a study's runs begin at the impact, too: nothing is known of the flight before it
    fixed = {entry.key for entry in OF_THE_FLIGHT}
    share = uncertainties(sizes, records)
    share |= {key: known for key, known in stored.items() if key not in fixed}
    own = runs.obtain(full_contact, meshed[-1][0], None, meshed[-1][1])
    same, predicted = (runs.obtain(reduced, scene, contact, start) for start in (impact, None))
    rows = compare_runs(3, same, records[-1], share, SAME)
    rows += compare_runs(3, predicted, own, share, OWN)
    return rows, records[-1], own, predicted


def causes(
    scene: NamedScene,
    impact: Impact,
    found: ContactIdentification,
    reference: RunRecord,
    runs: LadderRuns,
) -> list[dict[str, Any]]:
    """From the blind prediction to the reference, one change at a time, from one impact state.

    Step by step the solid replaces the reduced model: with the same spring at its flat end's middle
    (beam or solid), then at the hemisphere's lowest point (where and how the tip touches), with
    Hertz's law of the same energy (the force law), and finally with its own contact.
    """
    ratio, lossless = 1 / found.eta_squared, scene.tables.tip.restitution == 1.0
    linear = Contact(found.normal_stiffness_N_per_m, ratio)
    hertz = Contact(found.normal_stiffness_N_per_m, ratio, found.force_N)
    changes = {
        "reduced model, identified k at the tip node": runs.obtain(reduced, scene, linear, impact),
        "the solid instead of the beams, same spring at its flat end": runs.obtain(
            lumped_solid, scene, linear, impact, EXPERIMENT
        ),
        "that spring at the sphere's lowest point, not at the tip node": runs.obtain(
            lumped_solid, scene, linear, impact, EXPERIMENT, "hemisphere"
        ),
        HERTZ if lossless else f"{HERTZ}, without losses": runs.obtain(
            lumped_solid, scene, hertz, impact, EXPERIMENT, "hemisphere"
        ),
        f"the solid's own contact ({reference.variant})": reference,
    }
    forces = ("peak_N", "impulse_mN_s", "duration_us")
    return [
        {"scene": scene.name, "step": step}
        | {n: of.read(run) or math.nan for n, of in zip(forces, OF_A_TAP, strict=True)}
        for step, run in changes.items()
    ]


def mesh_keys(mesh: tuple[float, ...] | None, diameter: float) -> tuple[list[str], str]:
    """The scene's keys of a mesh, and its name."""
    preset = ["solver.fem.preset=converged", NO_FEM_ACCURACY]
    if mesh is None:
        return preset, "preset converged"
    tip, growth, section, axial = mesh
    keys = [
        *preset,
        f"solver.fem.tip_size={tip * diameter}",
        f"solver.fem.growth={growth}",
        f"solver.fem.section_size={section * diameter}",
        f"solver.fem.axial_size={axial * diameter}",
    ]
    return keys, f"edge {1e3 * tip * diameter:.2g} mm"


def paper_rung(runs: Runs) -> list[Comparison]:
    """Rung 4: the paper's k against the `ls-dyna-like` reference, each from its own flight.

    The reference's uncertainty is what the run states or, if it is farther, its distance to the
    farthest of the validation's other meshes and penalties: half their range would not reach it.
    """
    rows = []
    for scene in runs.scenes:
        beams, reference = runs.find(scene, PAPER_REDUCED), runs.find(scene, PAPER_REFERENCE)
        if beams is None or reference is None:
            continue
        share = {}
        for entry in COMPARED:
            band, value = spread(runs.spread_over(scene), entry), entry.read(reference)
            stated = entry.error(reference)
            if value and (band is not None or stated is not None):
                reach = 0.0 if band is None else max(band[1] - value, value - band[0])
                share[entry.key] = max(reach, stated or 0.0) / abs(value)
        rows += compare_runs(4, beams, reference, share, OWN)
    return rows

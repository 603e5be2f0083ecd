"""Rungs 2 and 3 of a scene, and the experiment that names what separates the two models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from validation.compare.grid_convergence import convergence
from validation.harness.quantities import COMPARED
from validation.harness.record import RunRecord
from validation.identify.contact import ContactIdentification
from validation.models.impact import Impact
from validation.scenes.load import NamedScene
from validation.validate.ladder.row import OWN, SAME, Row, compare
from validation.validate.ladder.runs import Contact, scene_contact
from validation.validate.ladder.stored_runs import LadderRuns

# Edges of section and axis over the diameter, coarse to fine: 15 mm gives 2.25, 1.5, 1.2 mm.
STRUCTURE = ((0.15, 0.2), (0.1, 0.133), (0.08, 0.107))
STRUCTURE_FULL = ((0.1, 0.133), (0.067, 0.089), (0.05, 0.067))
EXPERIMENT = (0.1, 0.133)
# Edge at the contact over the diameter, growth, edges of section and axis; coarse to fine.
CONTACT = ((0.0267, 1.6, 0.1, 0.167), (0.0133, 1.4, 0.1, 0.167))
CONVERGED = 0.006  # that edge of the preset `converged`
CONTACT_FULL = (CONTACT[-1], (0.0094, 1.3, 0.085, 0.12), None)  # None: the preset
ORDER = 2.0  # of the trilinear elements


@dataclass(frozen=True)
class Cause:
    """One step of the experiment: what is changed, and what the forces then are."""

    scene: str
    step: str
    peak_N: float
    duration_us: float
    impulse_mN_s: float


def uncertainties(sizes: Sequence[float], records: Sequence[RunRecord]) -> dict[str, float]:
    """Relative uncertainty of the finest run by key: index or spread (see `convergence`)."""
    found = {}
    for entry in COMPARED:
        values = [value for record in records if (value := entry.read(record)) is not None]
        if len(values) != len(records) or not values[-1]:
            continue
        if len(values) > 2:
            found[entry.key] = convergence(sizes, values, ORDER).uncertainty
        elif len(values) > 1:
            found[entry.key] = abs((values[-1] - values[-2]) / values[-1])
    return found


def structure(scene: NamedScene, impact: Impact, full: bool, runs: LadderRuns) -> list[Row]:
    """Rung 2: the scene's lumped law on both bodies, the solid's end being flat."""
    contact = scene_contact(scene)
    ladder = STRUCTURE_FULL if full else STRUCTURE
    rows = []
    for name, start in ((SAME, impact), (OWN, None)):
        records = [runs.lumped_solid(scene, contact, start, edges) for edges in ladder]
        share = uncertainties([edges[0] for edges in ladder], records)
        rows += compare(2, runs.reduced(scene, contact, start), records[-1], share, name)
    return rows


def blind(
    source: str,
    scene: NamedScene,
    impact: Impact,
    found: ContactIdentification,
    stored: Mapping[str, float],
    full: bool,
    runs: LadderRuns,
) -> tuple[list[Row], RunRecord, RunRecord, RunRecord]:
    """Rung 3: the identified k and eta^2 against the solid's own contact.

    Parameters
    ----------
    stored : relative uncertainties of the preset `converged` by key, where a study has them.

    Returns
    -------
    The rows, and the finest runs: of the reference from the common impact, of the reference and
    of the reduced model each from its own flight.
    """
    contact = Contact(found.stiffness_N_per_m, 1 / found.eta_squared)
    diameter = min(scene.tables.per_phalanx(scene.tables.finger.diameter))
    ladder = CONTACT_FULL if full else CONTACT
    settings = [_overrides(level, diameter) for level in ladder]
    names = ["preset converged" if level is None else f"edge {1e3 * level[0] * diameter:.2g} mm"
             for level in ladder]  # fmt: skip
    records = [
        runs.full_contact(source, overrides, impact, name)
        for overrides, name in zip(settings, names, strict=True)
    ]
    sizes = [CONVERGED if level is None else level[0] for level in ladder]
    share = uncertainties(sizes, records)
    if full:
        share |= stored
    own = runs.full_contact(source, settings[-1], None, names[-1])
    rows = compare(3, runs.reduced(scene, contact, impact), records[-1], share, SAME)
    predicted = runs.reduced(scene, contact, None)
    rows += compare(3, predicted, own, share, OWN)
    return rows, records[-1], own, predicted


def _overrides(level: tuple[float, ...] | None, diameter: float) -> list[str]:
    if level is None:
        return ["solver.fem.preset=converged"]
    tip, growth, section, axial = level
    return [
        "solver.fem.preset=converged",
        f"solver.fem.tip_size={tip * diameter}",
        f"solver.fem.growth={growth}",
        f"solver.fem.section_size={section * diameter}",
        f"solver.fem.axial_size={axial * diameter}",
    ]


def causes(
    scene: NamedScene,
    impact: Impact,
    found: ContactIdentification,
    reference: RunRecord,
    runs: LadderRuns,
) -> list[Cause]:
    """From the blind prediction to the reference, one change at a time, from one impact state.

    The solid takes the reduced model's steps back: same spring at the flat end's middle (the beam
    against the solid), on the hemisphere's lowest point (where and how the tip touches), with
    Hertz's law of the same energy (the force law), and at last the contact itself.
    """
    ratio = 1 / found.eta_squared
    linear = Contact(found.stiffness_N_per_m, ratio)
    hertz = Contact(found.stiffness_N_per_m, ratio, found.force_N)
    changes = (
        ("reduced model, identified k at the tip node", runs.reduced(scene, linear, impact)),
        (
            "the solid in the beams' place, same spring at its flat end",
            runs.lumped_solid(scene, linear, impact, EXPERIMENT),
        ),
        (
            "that spring at the sphere's lowest point, not at the tip node",
            runs.lumped_solid(scene, linear, impact, EXPERIMENT, "hemisphere"),
        ),
        (
            "Hertz's law of the same energy in the linear spring's place",
            runs.lumped_solid(scene, hertz, impact, EXPERIMENT, "hemisphere"),
        ),
        (f"the solid's own contact ({reference.variant})", reference),
    )
    return [
        Cause(
            scene.name,
            step,
            record.value("peak_normal_force_N") or float("nan"),
            1e6 * (record.value("contact_duration_s") or float("nan")),
            1e3 * (record.value("normal_impulse_N_s") or float("nan")),
        )
        for step, record in changes
    ]

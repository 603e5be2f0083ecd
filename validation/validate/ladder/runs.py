"""The runs that the ladder compares: each model with a given contact, from a given start."""

import dataclasses
from collections.abc import Callable
from typing import Any, Concatenate, Literal, ParamSpec

import hcm
from validation.errors import RunFailedError, UserError
from validation.harness.identity import program
from validation.harness.interrupts import unless_interrupted
from validation.harness.record import RunRecord, plain
from validation.harness.store import NO_STORE, Store
from validation.harness.stored_run import keep_run, load_run
from validation.models import solid_inputs, solid_mesh
from validation.models.adapter import to_record
from validation.models.hcm import hcm_scene
from validation.models.impact import Impact, chain_state
from validation.models.inputs import scene_inputs
from validation.scenes.load import NamedScene

P = ParamSpec("P")


@dataclasses.dataclass(frozen=True)
class Contact:
    """The lumped law's constants: k (N/m), eta^-2, and F* of Hertz's law or None."""

    stiffness: float
    tangential_ratio: float
    hertz_force: float | None = None


def scene_contact(scene: NamedScene) -> Contact:
    """The scene's own constants, which in the built-in scenes are the paper's."""
    return Contact(hcm_scene(scene, estimate=False).tip.k, scene.tables.tangential_ratio)


def _completed(record: RunRecord) -> RunRecord:
    if not unless_interrupted(record).ok:
        raise RunFailedError(f"{record.scene} {record.label}: {record.message}")
    return record


def reduced(scene: NamedScene, contact: Contact, start: Impact | None) -> RunRecord:
    """Run the reduced model from `start`; None: from its own flight."""
    given = hcm_scene(scene, estimate=False)
    k, ratio = contact.stiffness, contact.tangential_ratio
    tip = dataclasses.replace(given.tip, normal_stiffness=k, tangential_ratio=ratio)
    given = dataclasses.replace(given, tip=tip)
    if start is not None:
        state = hcm.RigidStart(start.angles, start.rates, start.time_s)
        given = dataclasses.replace(given, start=state)
    return _completed(to_record(hcm.simulate_scene(given), scene, "hcm"))


def lumped_solid(
    scene: NamedScene,
    contact: Contact,
    start: Impact | None,
    edges: tuple[float, float],
    tip: Literal["flat", "hemisphere"] = "flat",
) -> RunRecord:
    """Run the solid with the lumped law at its flat end or on its hemisphere.

    edges : of the section and along the axis, over the finger's diameter.
    """
    import meshes
    import reference_fem

    tables = scene.tables
    diameters = tables.per_phalanx(tables.finger.diameter)
    section, axial = (edge * min(diameters) for edge in edges)
    geometry = meshes.FingerGeometry(tables.per_phalanx(tables.finger.length), diameters, tip)
    mesh = meshes.finger_hexahedra(geometry, meshes.Sizing(section, axial, section))
    materials, surface, drive, settings = solid_inputs.solid_parts(tables)
    if start is not None and tip == "hemisphere":
        surface = dataclasses.replace(surface, height=start.sphere_height_m)
    law = reference_fem.LumpedContact(
        contact.stiffness,
        tables.tip.restitution if contact.hertz_force is None else 1.0,
        contact.tangential_ratio,
        contact.hertz_force,
    )
    settings = dataclasses.replace(settings, contact=law, flight="rigid")
    state = solid_inputs.start_of(tables) if start is None else chain_state(start)
    result = reference_fem.simulate(mesh, materials, surface, drive, settings, start=state)
    return _completed(to_record(result, scene, "fem3d", f"lumped law, {tip} end"))


def touching_meshes(scene: NamedScene, start: Impact | None) -> tuple[Any, Any]:
    """The scene's mesh, refined where the tip touches from `start` (None: after its own flight),
    and its companion.

    On the hard finger these two places are 0.75 mm apart, further than the even patch reaches.
    """
    sizing, _ = solid_mesh.sizing_of(scene.tables, 3)
    if start is not None and sizing is not None:
        sizing = dataclasses.replace(sizing, contact_angle=start.touch_angle)
    mesh = solid_mesh.build_mesh(scene.tables, 3, sizing)
    return mesh, solid_mesh.companion(scene.tables, 3, sizing)


def full_contact(scene: NamedScene, start: Impact | None, variant: str) -> RunRecord:
    """Run the solid with its own contact."""
    import reference_fem

    mesh, companion = touching_meshes(scene, start)
    materials, surface, drive, settings = solid_inputs.solid_parts(scene.tables)
    state = solid_inputs.start_of(scene.tables)
    if start is not None:
        surface = dataclasses.replace(surface, height=start.sphere_height_m)
        state = chain_state(start)
    light = solid_mesh.flight_mesh(scene.tables, 3)
    result = reference_fem.simulate(
        mesh, materials, surface, drive, settings, start=state, flight_mesh=light,
        companion=companion,
    )  # fmt: skip
    return _completed(to_record(result, scene, "fem3d", variant))


@dataclasses.dataclass(frozen=True)
class LadderRuns:
    """Runs of `reduced`, `lumped_solid` and `full_contact`, computed unless a store has them."""

    store: Store = NO_STORE

    def obtain(
        self,
        simulate: Callable[Concatenate[NamedScene, P], RunRecord],
        scene: NamedScene,
        *given: P.args,
        **named: P.kwargs,
    ) -> RunRecord:
        """The record of ``simulate(scene, *given, **named)``, one of this file's functions.

        Raises UserError: a solid refuses the scene.
        """
        inputs = {
            "program": program(__name__),
            "simulate": simulate.__name__,
            **scene_inputs(scene.tables, "hcm" if simulate is reduced else "fem3d"),
            "given": [_json(value) for value in given],
            "named": {name: _json(value) for name, value in named.items()},
        }
        record = load_run(self.store, inputs)
        if record is None:
            try:
                record = simulate(scene, *given, **named)
            except ValueError as error:  # what a solid or its mesh refuses
                raise UserError(str(error)) from error
            keep_run(self.store, inputs, record)
        return dataclasses.replace(record, scene=scene.name)


def _json(value: Any) -> Any:
    return plain(dataclasses.asdict(value) if isinstance(value, Contact | Impact) else value)

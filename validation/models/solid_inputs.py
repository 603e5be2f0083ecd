"""The solid models' inputs from a scene's tables: geometry, materials, drive, start, settings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from validation.models.adapter import drive_of
from validation.scenes.scene import Scene

if TYPE_CHECKING:
    import meshes
    import reference_fem

Dimension = Literal[2, 3]
DIMENSIONS: dict[str, Dimension] = {"fem3d": 3, "fem2d": 2}

# Contact law by preset, if it isn't the solver's default.
CONTACT = {"contact": "impulse", "converged": "impulse"}
NEEDED = {
    "penalty_factor": ("contact", "penalty"),
    "surface_factor": ("contact", "surface"),
    "contact_damping": ("contact", "surface"),
    "flight_size": ("flight", "coarse"),
}


class SolidParts(NamedTuple):
    """The reference's inputs beside its mesh; materials : one a phalanx."""

    materials: tuple[reference_fem.Material, ...]
    surface: reference_fem.Surface
    drive: reference_fem.Drive
    settings: reference_fem.Settings


def solid_parts(tables: Scene) -> SolidParts:
    """The scene as the reference takes it.

    Raises ValueError: as `solver_settings`, or the reference refuses a value.
    """
    import reference_fem

    material = tables.material
    elastic = material.youngs_modulus, material.poisson_ratio, material.density
    materials = tuple(
        reference_fem.Material(*properties)
        for properties in tables.rows(*elastic, material.relaxation_time or 0.0, material.law)
    )
    surface = reference_fem.Surface(height=tables.surface.height, friction=tables.surface.friction)
    return SolidParts(materials, surface, drive_of(tables, reference_fem), solver_settings(tables))


def finger_geometry(tables: Scene) -> meshes.FingerGeometry:
    """Geometry of the scene's finger, for meshes and the check of mesh files."""
    import meshes

    diameters = tables.per_phalanx(tables.finger.diameter)
    lengths = tables.per_phalanx(tables.finger.length)
    return meshes.FingerGeometry(lengths, diameters, shaft_radius=tables.solver.fem.shaft_radius)


def solver_settings(tables: Scene) -> reference_fem.Settings:
    """The reference's settings: its defaults, then the preset's, then the scene's own.

    Raises ValueError: the scene states a number of a contact law or flight that it does not use.
    """
    import reference_fem

    fem = tables.solver.fem
    preset = {"contact": CONTACT[fem.preset]} if fem.preset in CONTACT else {}
    stated = fem.stated(reference_fem.Settings)
    settings = reference_fem.Settings(**(preset | stated))
    for key, (name, needed) in NEEDED.items():
        value, chosen = getattr(fem, key), getattr(settings, name)
        if value is not None and chosen != needed:
            raise ValueError(
                f"solver.fem.{key} = {value:g}: has no effect on {name} = '{chosen}': set "
                f"solver.fem.{name} = '{needed}', or leave it out"
            )
    return settings


def start_of(tables: Scene) -> reference_fem.ChainState | None:
    """The scene's start in the form that the reference takes; None: horizontal, at rest."""
    import reference_fem

    if tables.start_state is None:
        return None
    angles, rates = map(np.array, tables.start_state)
    return reference_fem.ChainState(angles, rates, 0.0)


def variant(tables: Scene) -> str:
    """Preset or mesh file, holes for shafts, and the penalty factor where the scene changes it."""
    import reference_fem

    fem = tables.solver.fem
    name = fem.preset if fem.mesh is None else Path(fem.mesh).stem
    if fem.shaft_radius is not None:
        name += " shaft holes"
    if fem.penalty_factor in (None, reference_fem.Settings().penalty_factor):
        return name
    return f"{name} penalty {fem.penalty_factor:g}"

"""The solid models' inputs from a scene's tables: geometry, materials, drive, start, settings."""

from typing import Any, Literal, NamedTuple

from validation.models.adapter import torques_of
from validation.scenes.scene import Scene

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

    materials: Any
    surface: Any
    drive: Any
    settings: Any


def solid_parts(tables: Scene) -> SolidParts:
    """The scene as the reference takes it.

    Raises ValueError: as `solver_settings`, or the reference refuses a value.
    """
    import reference_fem

    material = tables.material
    elastic = material.youngs_modulus, material.poisson_ratio, material.density
    materials = tuple(
        reference_fem.Material(*properties)
        for properties in tables.rows(*elastic, material.relaxation_time)
    )
    surface = reference_fem.Surface(height=tables.surface.height, friction=tables.surface.friction)
    return SolidParts(materials, surface, drive_of(tables), solver_settings(tables))


def finger_geometry(tables: Scene) -> Any:
    """Geometry of the scene's finger, for meshes and the check of mesh files."""
    import meshes

    diameters = tables.per_phalanx(tables.finger.diameter)
    lengths = tables.per_phalanx(tables.finger.length)
    return meshes.FingerGeometry(lengths, diameters, shaft_radius=tables.solver.fem.shaft_radius)


def solver_settings(tables: Scene) -> Any:
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


def drive_of(tables: Scene) -> Any:
    """The scene's drive in the form that the reference takes."""
    import reference_fem

    return reference_fem.Drive(
        **torques_of(tables, reference_fem.TorqueTable),
        gravity=tables.drive.gravity,
        reaction=tables.drive.reaction,
        incline=tables.surface.incline,
    )


def start_of(tables: Scene) -> Any:
    """The scene's start in the form that the reference takes; None: horizontal, at rest."""
    import numpy as np

    import reference_fem

    if tables.start_state is None:
        return None
    angles, rates = map(np.array, tables.start_state)
    return reference_fem.ChainState(angles, rates, 0.0)

"""Materials that relax: where they do at an accuracy, and the contact law that they need."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from validation.models.solid_mesh import sizes_of
from validation.scenes.scene import Scene

if TYPE_CHECKING:
    import meshes
    import reference_fem


def materials_within(
    tables: Scene, touch: reference_fem.Touch | None, materials: tuple[reference_fem.Material, ...]
) -> tuple[reference_fem.Material, ...]:
    """The materials that the scene's accuracy asks for: see `reference_fem.estimates.accuracy`.

    They get a relaxation time if the tip slides with friction, unless the scene states one or asks
    for one-point elements, which have no damping. touch : the one that `sizing_of` predicts
    """
    import reference_fem

    sizes, undamped = sizes_of(tables), tables.solver.fem.element == reference_fem.ONE_POINT
    stated = undamped or tables.material.relaxation_time is not None
    if sizes is None or stated or sizes.relaxation == 0.0 or touch is None:
        return materials
    share = sizes.relaxation * touch.patch_radius
    return tuple(replace(m, relaxation_time=share / m.bar_speed) for m in materials)


def relaxes_near_the_touch(tables: Scene, sizing: meshes.Sizing | None) -> bool:
    """Whether only elements near the touch get the relaxation time of an accuracy.

    All of them do where a shaft touches, which may be all along, where a run goes on to further
    taps, which may be elsewhere, and on a mesh file.
    """
    return sizing is not None and not sizing.lies and tables.solver.fem.end_time is None


def law_for(
    tables: Scene,
    sizing: meshes.Sizing | None,
    last: reference_fem.Material,
    settings: reference_fem.Settings,
) -> reference_fem.Settings:
    """The settings, with a pressure over the surface instead of a preset's impulses where the
    scene states a relaxation time longer than a wave takes along an edge at the contact.

    An impulse stops a node within a step, and the element behind it resists by tau times the rate
    of its strain: each touch of a node is a spike. With tau = 20 us the soft finger's peak is 79.3
    N by pressure, 88.3 N by impulses on the same mesh, in as many steps, as tau limits them.
    last : the last phalanx's material, as the scene states it
    """
    if sizing is None or "contact" in tables.solver.fem.model_fields_set:
        return settings
    if settings.contact != "impulse" or last.relaxation_time * last.bar_speed <= sizing.tip_size:
        return settings
    return replace(settings, contact="surface")


def relaxing_near(
    tables: Scene, touch: reference_fem.Touch, sizing: meshes.Sizing, mesh: meshes.FingerMesh
) -> meshes.FingerMesh:
    """The mesh with the elements near the touch as the set ``relaxing``, each phalanx's first.

    The touch at rest is c + R (-cos, -sin)(angle), c the centre of the tip's ball, R its radius.
    """
    from reference_fem.estimates.accuracy import RELAXATION_REACH

    sizes, radius = sizes_of(tables), tables.tip_radius
    there = replace(sizing, contact_angle=touch.angle)
    if sizes is None or not relaxes_near_the_touch(tables, there):
        return mesh
    place = np.zeros(mesh.dim)
    tip = -sum(tables.per_phalanx(tables.finger.length))
    place[0] = tip + radius * (1.0 - math.cos(touch.angle))
    place[1] = -radius * math.sin(touch.angle)
    away = np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - place, axis=1)
    near = away <= max(RELAXATION_REACH * touch.patch_radius, away.min())
    # kernels take elements in blocks, which cost less where none relaxes
    bodies = [cells for name, cells in mesh.cell_sets.items() if name != "relaxing"]
    order = np.concatenate([body[np.argsort(~near[body], kind="stable")] for body in bodies])
    new = np.argsort(order)  # a permutation's inverse
    sets = {name: np.sort(new[cells]) for name, cells in mesh.cell_sets.items()}
    sets["relaxing"] = np.flatnonzero(near[order])
    return replace(mesh, cells=mesh.cells[order], cell_sets=sets)


def relaxing_nowhere(mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    """The mesh of a coarse flight: no tip slides in it."""
    return replace(mesh, cell_sets={**mesh.cell_sets, "relaxing": np.empty(0, dtype=np.int64)})

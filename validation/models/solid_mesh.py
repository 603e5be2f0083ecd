"""The solid models' meshes: sizes by preset, accuracy and predicted patch, and a companion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from validation.models.solid_inputs import Dimension, finger_geometry, solid_parts, start_of
from validation.scenes.scene import Scene

if TYPE_CHECKING:
    import meshes
    import reference_fem
    from reference_fem.estimates.accuracy import Sizes

# Presets with even edges around the predicted contact patch, up to EVEN_PATCH times its radius;
# `contact` divides that radius, at least LEAST_PATCH of the tip's, into PATCH_EDGES edges.
EVEN_TIPS, EVEN_PATCH = ("contact", "converged"), 1.3
PATCH_EDGES, LEAST_PATCH = 2.5, 0.02
PRESET_DIAMETER = 0.015  # m, the finger that the presets' element sizes are meant for
COARSER, FINER = 2.0, 0.75  # edges of a run's companion mesh over its own
FEW = 600  # elements
OF_REFINED = ("growth", "patch_size", "halvings")  # sizes that a tip of even edges does not have
COARSE_SECTION = 0.25  # edges of a coarse flight's mesh over the smallest diameter
CLEARANCE = 0.01  # over the tip's radius, in an impact state; nodes stand out by less


def build_mesh(tables: Scene, dimension: Dimension, sizing: Any = None) -> Any:
    """The finger's mesh, with the sizes from `sizing_of` unless they are given.

    ``solver.fem.mesh`` replaces it by a file, relative to the current folder.
    ``solver.fem.symmetry = false`` makes both halves of the body in 3D, from a file too.
    """
    fem = tables.solver.fem
    if fem.mesh is not None:
        return _read_mesh(tables, fem.mesh, dimension)
    return _mesh(tables, dimension, sizing or sizing_of(tables, dimension)[0])


def _read_mesh(tables: Scene, path: str, dimension: Dimension) -> meshes.FingerMesh:
    """Read a mesh file, which must fit the scene's finger."""
    import meshes

    try:
        mesh = meshes.read(path)
    except meshes.MeshError as error:
        raise ValueError(f"solver.fem.mesh = {error}") from error
    key = f"solver.fem.mesh = {path}"
    if mesh.dim != dimension:
        raise ValueError(f"{key}: is a {mesh.dim}D mesh; use --model fem{mesh.dim}d")
    geometry = finger_geometry(tables)
    try:
        meshes.check_finger(mesh, geometry)
    except meshes.MeshError as error:
        raise ValueError(f"{key}: is not the scene's finger: {error}; make them agree") from error
    return _whole(tables, replace(mesh, shape=geometry))


def _mesh(tables: Scene, dimension: Dimension, sizing: meshes.Sizing) -> meshes.FingerMesh:
    import meshes

    geometry = finger_geometry(tables)
    if dimension == 2:
        return meshes.finger_quadrilaterals(geometry, sizing)
    return _whole(tables, meshes.finger_hexahedra(geometry, sizing))


def _whole(tables: Scene, mesh: meshes.FingerMesh) -> meshes.FingerMesh:
    """The mesh, or both halves of the body where the scene asks for them in 3D."""
    import meshes

    return mesh if mesh.dim == 2 or tables.solver.fem.symmetry else meshes.mirrored(mesh)


def companion(
    tables: Scene, dimension: Dimension, sizing: meshes.Sizing | None
) -> meshes.FingerMesh | None:
    """The companion mesh of a run on `build_mesh`: see `reference_fem.estimates.estimate`.

    Its edges are `COARSER` times as long or, if there is no such mesh (`coarser_sizes`), it has
    2^dimension times as many elements. A mesh file has no companion.
    """
    import meshes

    if sizing is None:
        return None
    other = coarser_sizes(tables, dimension, sizing)
    if other is None:
        geometry, other = finger_geometry(tables), sizing
        own = meshes.count_elements(geometry, sizing, dimension)
        while meshes.count_elements(geometry, other, dimension) < 2**dimension * own:
            other = other.coarser(FINER)
    return _mesh(tables, dimension, other)


def coarser_sizes(
    tables: Scene, dimension: Dimension, sizing: meshes.Sizing
) -> meshes.Sizing | None:
    """Edges `COARSER` times as long; None if there are at most `FEW` elements, and that would leave
    more than half of them.
    """
    import meshes

    geometry = finger_geometry(tables)
    other = sizing.coarser(COARSER)
    other = replace(
        other,
        section_size=min(other.section_size, *geometry.diameters),
        axial_size=min(other.axial_size, *geometry.lengths),
        tip_size=min(other.tip_size, *geometry.diameters),
    )
    own, its = (meshes.count_elements(geometry, s, dimension) for s in (sizing, other))
    return None if own <= FEW and 2 * its > own else other


def flight_mesh(tables: Scene, dimension: Dimension) -> Any:
    """The mesh of a coarse flight; None if the flight is not coarse."""
    if tables.solver.fem.flight != "coarse":
        return None
    import meshes

    sizing = _flight_sizing(tables)
    try:
        return _mesh(tables, dimension, sizing)
    except meshes.MeshError as error:
        edge = f"solver.fem.flight_size = {sizing.section_size:g}"
        raise ValueError(f"{edge}, all three sizes of the mesh in flight: {error}") from error


def _flight_sizing(tables: Scene) -> meshes.Sizing:
    """Even edges of `flight_size`, or `COARSE_SECTION` of the smallest diameter."""
    import meshes

    fem, diameter = tables.solver.fem, tables.smallest_diameter
    edge = COARSE_SECTION * diameter if fem.flight_size is None else fem.flight_size
    if edge > diameter:
        raise ValueError(
            f"solver.fem.flight_size = {edge:g}: must be at most the smallest diameter,"
            f" {diameter:g} m"
        )
    axial = min(edge, *tables.per_phalanx(tables.finger.length))
    return meshes.Sizing(edge, axial, edge, full_volume=True)


def sizing_of(tables: Scene, dimension: Dimension) -> tuple[Any, Any]:
    """The preset's sizes, scaled with the diameter, then the scene's own; None for a mesh file.

    A tip finer than the section is refined where the rigid finger touches the surface; with the
    preset ``contact``, or an accuracy, the patch that is predicted there sets the size.

    Returns
    -------
    The sizes, and the `predicted_touch`: None if no size depends on it or there is no touch.
    """
    import meshes
    from reference_fem.estimates.accuracy import GROWTH, HALVINGS

    fem, sizes = tables.solver.fem, sizes_of(tables)
    if fem.mesh is not None:
        return None, None
    stated = fem.stated(meshes.Sizing)
    base, scale = meshes.SIZINGS[fem.preset], size_scale(tables)
    lengths = ("section_size", "axial_size", "tip_size", "patch_size")
    base = replace(base, **{name: scale * getattr(base, name) for name in lengths})
    if sizes is not None:
        diameter = tables.smallest_diameter
        base = meshes.Sizing(
            section_size=sizes.section * diameter,
            axial_size=min(sizes.section * diameter, *tables.per_phalanx(tables.finger.length)),
            tip_size=0.5 * sizes.section * diameter,
            growth=GROWTH,
            halvings=HALVINGS,
            full_volume=True,
        )
    sizing = replace(base, **stated)
    by_patch = fem.preset == "contact" and "tip_size" not in stated
    refined = by_patch or sizing.tip_size < sizing.section_size
    idle = [key for key in OF_REFINED if stated.get(key)]
    if idle and not refined and "tip_size" not in stated:
        raise ValueError(
            f"solver.fem.{idle[0]} = {stated[idle[0]]:g}: has no effect on the even tip of preset"
            f" '{fem.preset}': state a solver.fem.tip_size below section_size, or leave it out"
        )
    touch = predicted_touch(tables, dimension) if refined or sizes is not None else None
    if touch is None or not refined:
        return sizing, touch
    patch = max(touch.patch_radius, LEAST_PATCH * tables.tip_radius)
    if fem.preset in EVEN_TIPS:
        base = replace(base, patch_size=EVEN_PATCH * patch)
    if fem.preset == "contact":
        edge = 1.0 / PATCH_EDGES if sizes is None else sizes.edge
        base = replace(base, tip_size=min(edge * patch, sizing.section_size))
    return replace(base, contact_angle=touch.angle, **stated), touch


def sizes_of(tables: Scene) -> Sizes | None:
    """The sizes that the scene's accuracy asks for; None if no accuracy applies.

    Raises ValueError: the accuracy cannot be kept, or a preset is stated as well.
    """
    import reference_fem

    accuracy, fem = tables.solver.accuracy_of("fem"), tables.solver.fem
    if accuracy is None or fem.mesh is not None:
        return None
    if fem.preset != "contact":
        raise ValueError(
            f"solver.fem.preset = {fem.preset!r}: sets what solver.accuracy = {accuracy:g} would "
            "choose; leave one of them out"
        )
    return reference_fem.sizes_for(accuracy, tables.surface.friction)


def size_scale(tables: Scene) -> float:
    """The factor on the presets' sizes for this finger."""
    return tables.smallest_diameter / PRESET_DIAMETER


def predicted_touch(tables: Scene, dimension: Dimension) -> Any:
    """Where and how hard the rigid finger touches; None if it never does."""
    import reference_fem

    state = impact_state(tables, dimension)
    if state is None:
        return None
    given = finger_geometry(tables), *solid_parts(tables)[:3]
    return reference_fem.predicted_touch(*given, state, dimension)


def touching_spring(tables: Scene, touch: Any) -> float:
    """The spring that holds Hertz's energy at the turn, k d^2/2 = 2/5 F d, d = a^2/R, N/m.

    touch : of the rigid finger (`predicted_touch`), with the force F and the patch's radius a.
    """
    return float(0.8 * touch.force * tables.tip_radius / touch.patch_radius**2)


def rod_flight(tables: Scene, dimension: Dimension) -> reference_fem.RodFlight:
    """A rigid flight, before anything is solved."""
    import reference_fem

    given = finger_geometry(tables), *solid_parts(tables)
    return reference_fem.rod_flight(*given, start_of(tables), dimension)


def coarse_flight_s(tables: Scene, dimension: Dimension, lasts_s: float) -> float:
    """Approximate solve time of a coarse flight that lasts `lasts_s`, s; inf if there are too many
    elements.

    A step is the time that a wave takes through half an edge, of a neo-Hookean body half of that.
    """
    import meshes
    from reference_fem import NEO_HOOKE
    from reference_fem.workload import UPDATES_PER_S

    sizing, materials = _flight_sizing(tables), solid_parts(tables).materials
    try:
        count = meshes.count_elements(finger_geometry(tables), sizing, dimension)
    except meshes.MeshError:
        return math.inf
    edge = min(sizing.section_size, sizing.axial_size)
    share = 0.25 if tables.material.law == NEO_HOOKE else 0.5
    step = share * edge / max(material.bar_speed for material in materials)
    return lasts_s / step * count / UPDATES_PER_S


def impact_state(tables: Scene, dimension: Dimension) -> reference_fem.ChainState | None:
    """Rigid state a little above the surface; None if it never gets there.

    Runs on different meshes that start from it hit the surface in the same way.
    """
    import reference_fem

    materials, surface, drive, settings = solid_parts(tables)
    return reference_fem.impact_state(
        finger_geometry(tables), materials, surface, drive, CLEARANCE * tables.tip_radius,
        settings.max_flight_time_s, start_of(tables), dimension,
    )  # fmt: skip

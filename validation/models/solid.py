"""Adapter of the two solid models: mesh, translation, timed solve."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from validation.errors import UserError
from validation.harness.fields import Fields
from validation.harness.interrupts import unless_interrupted
from validation.models.adapter import Checkpoint, Kind, Outcome, Progress, to_record, torques_of
from validation.models.solid_accuracy import held
from validation.scenes.load import NamedScene, load_scene
from validation.scenes.scene import Scene

Dimension = Literal[2, 3]
DIMENSIONS: dict[str, Dimension] = {"fem3d": 3, "fem2d": 2}

# Contact law by preset, where it isn't the solver's own default.
CONTACT = {"contact": "impulse", "converged": "impulse"}
# Presets whose tip has even edges where the patch of contact is predicted, up to EVEN_PATCH times
# its radius; the preset `contact` divides that radius, at least a share of the tip's, into edges.
EVEN_TIPS, EVEN_PATCH = ("contact", "converged"), 1.3
PATCH_EDGES, LEAST_PATCH = 2.5, 0.02
OF_LAWS = {"penalty_factor": "penalty", "surface_factor": "surface", "contact_damping": "surface"}
PRESET_DIAMETER = 0.015  # m, the finger that the presets' element sizes are meant for
COARSER, FINER = 2.0, 0.75  # edges of the mesh that a run is compared with, over its own
FEW = 600  # elements
CLEARANCE = 0.01  # of the tip's radius, below an impact state; covers what meshes differ by

WARM_UP = (  # once for each law that a preset takes
    "solver.fem.estimate=false",
    "surface.height=0.06",
    "solver.fem.section_size=5e-3",
    "solver.fem.axial_size=1e-2",
    "solver.fem.tip_size=5e-3",
)


def build_mesh(tables: Scene, dimension: Dimension, sizing: Any = None) -> Any:
    """The finger's mesh, of the sizes that `sizing_of` finds unless they are given.

    ``solver.fem.symmetry = false`` meshes both halves of the body in 3D.
    ``solver.fem.mesh`` replaces it by a file, relative to the current folder.
    """
    fem = tables.solver.fem
    if fem.mesh is not None:
        return _read_mesh(tables, fem.mesh, dimension)
    return _mesh(tables, dimension, sizing or sizing_of(tables, dimension))


def companion(tables: Scene, dimension: Dimension, sizing: Any) -> Any:
    """What a run on `build_mesh` is compared with: see `reference_fem.estimate`.

    A mesh of `COARSER` edges; where so `FEW` elements are in blocks that cannot spare half of them,
    one of edges so fine that it has 2^dimension as many. A mesh that is read has none.
    """
    import meshes

    if sizing is None:
        return None
    geometry = finger_geometry(tables)
    other = sizing.coarser(COARSER)
    other = replace(
        other,
        section_size=min(other.section_size, *geometry.diameters),
        axial_size=min(other.axial_size, *geometry.lengths),
        tip_size=min(other.tip_size, *geometry.diameters),
    )
    own, its = (meshes.count_elements(geometry, s, dimension) for s in (sizing, other))
    if own <= FEW and 2 * its > own:
        other = sizing
        while meshes.count_elements(geometry, other, dimension) < 2**dimension * own:
            other = other.coarser(FINER)
    return _mesh(tables, dimension, other)


def sizing_of(tables: Scene, dimension: Dimension) -> Any:
    """The preset's sizes, scaled with the diameter, then the scene's own; None of a mesh file.

    A tip finer than the section is refined where the rigid finger touches the surface; that of the
    preset ``contact``, or of an accuracy, is sized by the patch that is predicted there.
    """
    import meshes

    fem, sizes = tables.solver.fem, sizes_of(tables)
    if fem.mesh is not None:
        return None
    stated = fem.stated(meshes.Sizing)
    base = _scaled(meshes.SIZINGS[fem.preset], tables)
    if sizes is not None:
        diameter = min(tables.per_phalanx(tables.finger.diameter))
        base = meshes.Sizing(
            section_size=sizes.section * diameter,
            axial_size=min(sizes.section * diameter, *tables.per_phalanx(tables.finger.length)),
            tip_size=0.5 * sizes.section * diameter,
            growth=sizes.growth,
            halvings=sizes.halvings,
            full_volume=True,
        )
    sizing = replace(base, **stated)
    if sizing.tip_size >= sizing.section_size:
        return sizing
    touch = predicted_touch(tables, dimension)
    if touch is None:
        return sizing
    radius = 0.5 * tables.per_phalanx(tables.finger.diameter)[-1]
    patch = max(touch.patch_radius, LEAST_PATCH * radius)
    if fem.preset in EVEN_TIPS:
        base = replace(base, patch_size=EVEN_PATCH * patch)
    if fem.preset == "contact":
        edge = 1.0 / PATCH_EDGES if sizes is None else sizes.edge
        base = replace(base, tip_size=min(edge * patch, base.section_size))
    return replace(base, contact_angle=touch.angle, **stated)


def sizes_of(tables: Scene) -> Any:
    """What the scene's accuracy asks of the mesh; None where it asks for none.

    Raises
    ------
    ValueError
        It cannot be kept, or a preset is stated beside it.
    """
    import reference_fem

    accuracy, fem = tables.solver.accuracy_of("fem"), tables.solver.fem
    if accuracy is None:
        return None
    if fem.preset != "contact":
        raise ValueError(
            f"solver.fem.preset = {fem.preset!r}: decides what solver.accuracy = {accuracy:g} is "
            "to; leave one of them out"
        )
    return reference_fem.sizes_for(accuracy)


def size_scale(tables: Scene) -> float:
    """What the presets' sizes are multiplied by for this finger."""
    return min(tables.per_phalanx(tables.finger.diameter)) / PRESET_DIAMETER


def _scaled(sizing: Any, tables: Scene) -> Any:
    names = ("section_size", "axial_size", "tip_size", "patch_size")
    sizes = {name: size_scale(tables) * getattr(sizing, name) for name in names}
    return replace(sizing, **sizes)


def _mesh(tables: Scene, dimension: Dimension, sizing: Any) -> Any:
    import meshes

    geometry = finger_geometry(tables)
    if dimension == 2:
        return meshes.finger_quadrilaterals(geometry, sizing)
    half = meshes.finger_hexahedra(geometry, sizing)
    return half if tables.solver.fem.symmetry else meshes.mirrored(half)


def finger_geometry(tables: Scene) -> Any:
    """The scene's finger, as meshes and mesh files must have it."""
    import meshes

    diameters = tables.per_phalanx(tables.finger.diameter)
    lengths = tables.per_phalanx(tables.finger.length)
    return meshes.FingerGeometry(lengths, diameters, shaft_radius=tables.solver.fem.shaft_radius)


def impact_state(tables: Scene, dimension: Dimension) -> Any:
    """Rigid state a little above the surface, by the ``fast`` mesh's masses; None if never there.

    Runs on different meshes that start from it hit the surface alike.
    """
    return _impact(tables, _fast_mesh(tables, dimension))


def _impact(tables: Scene, mesh: Any) -> Any:
    """The `impact_state` by the masses of this mesh."""
    import reference_fem

    materials, surface, drive, settings = inputs(tables)
    clearance = CLEARANCE * 0.5 * tables.per_phalanx(tables.finger.diameter)[-1]
    limit = settings.max_flight_time_s
    start = start_of(tables)
    return reference_fem.impact_state(mesh, materials, surface, drive, clearance, limit, start)


def predicted_touch(tables: Scene, dimension: Dimension) -> Any:
    """Where and how hard the rigid finger touches; None if it never does."""
    import reference_fem

    mesh = _fast_mesh(tables, dimension)
    state = _impact(tables, mesh)
    if state is None:
        return None
    return reference_fem.predicted_touch(mesh, *inputs(tables)[:3], state)


def _fast_mesh(tables: Scene, dimension: Dimension) -> Any:
    import meshes

    return _mesh(tables, dimension, _scaled(meshes.SIZINGS["fast"], tables))


def _read_mesh(tables: Scene, path: str, dimension: Dimension) -> Any:
    """A mesh file, which must be the scene's finger."""
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
    return replace(mesh, shape=geometry)


def solver_settings(tables: Scene) -> Any:
    """The reference's settings: its defaults, then the preset's, then the scene's own.

    Raises
    ------
    ValueError
        The scene states a number of a contact law that it does not take.
    """
    import reference_fem

    fem = tables.solver.fem
    preset = {"contact": CONTACT[fem.preset]} if fem.preset in CONTACT else {}
    stated = fem.stated(reference_fem.Settings)
    settings = reference_fem.Settings(**(preset | stated))
    for key, law in OF_LAWS.items():
        if key in stated and settings.contact != law:
            raise ValueError(
                f"solver.fem.{key} = {stated[key]:g}: has no effect on contact = "
                f"'{settings.contact}': set solver.fem.contact = '{law}', or leave it out"
            )
    return settings


def inputs(tables: Scene) -> tuple[Any, Any, Any, Any]:
    """Materials, surface, drive and settings of the reference."""
    import reference_fem

    material = tables.material
    elastic = material.youngs_modulus, material.poisson_ratio, material.density
    materials = tuple(
        reference_fem.Material(*properties)
        for properties in tables.rows(*elastic, material.relaxation_time)
    )
    surface = reference_fem.Surface(height=tables.surface.height, friction=tables.surface.friction)
    return materials, surface, drive_of(tables), solver_settings(tables)


def drive_of(tables: Scene) -> Any:
    """The scene's drive as the reference takes it."""
    import reference_fem

    return reference_fem.Drive(
        **torques_of(tables, reference_fem.TorqueTable),
        gravity=tables.drive.gravity,
        reaction=tables.drive.reaction,
        incline=tables.surface.incline,
    )


def start_of(tables: Scene) -> Any:
    """The scene's start as the reference takes it; None: horizontal, at rest."""
    import numpy as np

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


@dataclass(frozen=True)
class Solid:
    """The adapter of ``fem3d`` or of ``fem2d`` (plane stress)."""

    name: str
    kind: Kind = "reference"
    settings: str = "fem"
    resumable: bool = True
    sources: tuple[str, ...] = (__name__,)
    independent_of: tuple[str, ...] = ("hcm",)

    @property
    def dimension(self) -> Dimension:
        """3 or 2."""
        return DIMENSIONS[self.name]

    def refusal(self, scene: NamedScene) -> str:
        """What they can't take is told where the scene is translated."""
        del scene
        return ""

    def warm_up(self) -> None:
        """Tap once with a coarse mesh from 52.5 mm: every kernel is loaded."""
        for law in ("penalty", "impulse"):
            scene = load_scene("soft", (*WARM_UP, f"solver.fem.contact={law}"))
            unless_interrupted(self.run(scene).record)

    def run(
        self,
        scene: NamedScene,
        progress: Progress | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Outcome:
        """Mesh, translate and solve; the solve alone is timed."""
        import reference_fem

        tables = scene.tables
        try:  # bad sizes, geometry or settings are ValueErrors that name the key
            start = time.perf_counter()
            sizing = sizing_of(tables, self.dimension)
            mesh = build_mesh(tables, self.dimension, sizing)
            mesh_time = time.perf_counter() - start
            materials, surface, drive, settings = inputs(tables)
            sizes = sizes_of(tables)
            if sizes is not None and self.dimension == 3 and settings.element is None:
                settings = replace(settings, element=sizes.element)
            beside = None
            if settings.estimate:
                beside = companion(tables, self.dimension, sizing)
            start = time.perf_counter()
            restart = None
            if checkpoint is not None:
                restart = reference_fem.Restart(checkpoint.path, checkpoint.resume)
            result = reference_fem.simulate(
                mesh,
                materials,
                surface,
                drive,
                settings,
                progress=progress,
                start=start_of(tables),
                restart=restart,
                companion=beside,
            )
            estimate_time = time.perf_counter() - start - result.summary.wall_time_s
        except ValueError as error:
            raise UserError(f"scene {scene.name}: {error}") from error
        solve_time = result.summary.wall_time_s
        record = to_record(result, scene, self.name, variant(tables), solve_time)
        times = {"mesh_time_s": mesh_time, "estimate_time_s": max(estimate_time, 0.0)}
        record = replace(
            record,
            statistics={**record.statistics, **times},
            accuracy=held(tables, sizing, settings, record),
        )
        return Outcome(record, Fields(mesh.points, mesh.cells, tuple(result.snapshots)))


FEM3D, FEM2D = Solid("fem3d"), Solid("fem2d")

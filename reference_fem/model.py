"""From mesh, materials, surface and drive to the arrays that the explicit loop runs on."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

import meshes
from reference_fem.arrays import Array, Index
from reference_fem.contact.law import ContactLaw
from reference_fem.contact.laws import TouchingBody, contact_law
from reference_fem.elements.base import ElementKernel
from reference_fem.elements.kinds import (
    chord_thickness,
    hex8,
    hex8_neo_hooke,
    hex8_one_point,
    quad4_plane_stress,
)
from reference_fem.elements.section import Section, build_section
from reference_fem.elements.stress_probe import StressProbe, build_probe
from reference_fem.joints.constraints import Constraints
from reference_fem.joints.couples import Couples, couples_of
from reference_fem.joints.hinges import Hinges, build_hinges, mean_weights
from reference_fem.mesh_sets import bodies, symmetry_plane, wanted
from reference_fem.rigid.rigid_chain import RigidChain, build_chain
from reference_fem.rigid.true_body import mass_factors, true_chain
from reference_fem.settings import (
    NEO_HOOKE,
    ONE_POINT,
    SAINT_VENANT,
    Drive,
    Material,
    MaterialLaw,
    Settings,
    Surface,
    check_materials,
)
from reference_fem.stable_step import stable_step
from reference_fem.ties import Ties, ties_of
from reference_fem.torques import Torques


@dataclass(frozen=True)
class Model:
    """Constants of a run. Masses, stiffnesses and torques are those of the mesh as given.

    points, cells : of the mesh
    kernel : elements
    mass, inverse_mass : (n_points,); 0 and 1 for hanging nodes, as `ties` needs them
    ties : hanging nodes
    symmetry_factor : 2 for a half model, else 1; turns the mesh's sums into the full body's
    symmetry : (k,), nodes held in the plane Z = 0
    hinges, couples, torques, contact, probe : see their classes
    pole : node at the tip's end on the axis
    chain : rigid chain for the flight; None for a free body (a mesh without hinges).
    body_of_point : (n_points,), phalanx of each node, from 0
    touching_body : the phalanx whose surface may touch
    contact_cells : (n,), cells with a node that may touch
    gravity_vector : acceleration of gravity, f, in the surface's frame, m/s²
    step_s : Δt
    transit_s : time that an axial wave takes along the last phalanx
    cell_transit_s : time that it takes across the smallest cell that may touch
    """

    points: Array
    cells: Index
    kernel: ElementKernel
    mass: Array
    inverse_mass: Array
    ties: Ties
    symmetry_factor: int
    symmetry: Index
    hinges: Hinges
    couples: Couples
    torques: Torques
    contact: ContactLaw
    probe: StressProbe
    pole: int
    chain: RigidChain | None
    body_of_point: Index
    touching_body: int
    contact_cells: Index
    surface: Surface
    gravity_vector: tuple[float, float]
    step_s: float
    transit_s: float
    cell_transit_s: float

    @property
    def constraints(self) -> Constraints:
        """What holds the body."""
        return Constraints(self.ties, self.symmetry, self.hinges)


# Formulations by space dimension, element and law; the first of each is the default.
ELEMENTS: dict[int, dict[tuple[str, MaterialLaw], Callable[..., ElementKernel]]] = {
    3: {
        ("hex8-sri", SAINT_VENANT): hex8,
        (ONE_POINT, SAINT_VENANT): hex8_one_point,
        ("hex8-sri", NEO_HOOKE): hex8_neo_hooke,
    },
    2: {("quad4-plane-stress", SAINT_VENANT): quad4_plane_stress},
}


def build_model(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    settings: Settings,
) -> Model:
    """Assemble the constants of a run.

    A mesh without any hinge set is a free body.

    Raises ValueError: sets are missing or not what they are named for, their numbers do not match
        materials or torques, hinges do not meet, or the mesh is not its `shape`.
    """
    count = mesh.phalanges
    check_materials(materials, count)
    phalanx, body_of_point, body_nodes = bodies(mesh)
    kernel = _kernel(mesh, materials, phalanx, settings)
    points, cells = kernel.points, kernel.cells
    symmetry = symmetry_plane(mesh)
    symmetry_factor = 2 if symmetry.size else 1
    ties = ties_of(mesh.ties)
    mass = ties.sums(kernel.lumped_mass)
    if mesh.shape is not None:
        true = true_chain(mesh.shape, materials, drive, mesh.dim)
        mass = mass * mass_factors(points, mass, body_nodes, true, symmetry_factor)
    kernel = replace(kernel, lumped_mass=mass)
    free = mass.copy()
    free[ties.nodes] = 1.0
    contact = contact_law(
        TouchingBody(
            mesh=mesh,
            facets=_surface(mesh, body_of_point),
            mass=mass,
            symmetry_factor=symmetry_factor,
            cell_volume=kernel.cell_volume,
            cell_bulk_modulus=np.array([m.bulk_modulus for m in materials])[phalanx],
            material=materials[-1],
            radius=float(mesh.radii[-1]),
        ),
        settings,
    )
    hinge_sides, hinge_points = _hinge_sides(mesh)
    contact_cells = np.flatnonzero(np.isin(cells, contact.nodes).any(axis=1))
    loads = drive.loads_for(count) / symmetry_factor
    last = np.flatnonzero(phalanx == count - 1)
    springs = contact.nodes, contact.stiffness
    step_s = settings.step_factor * stable_step(
        kernel, *springs, symmetry, contact.damping, ties, contact.coupled_eigenvalue
    )
    return Model(
        points=points,
        cells=cells,
        kernel=kernel,
        mass=mass,
        inverse_mass=1.0 / free,
        ties=ties,
        symmetry_factor=symmetry_factor,
        symmetry=symmetry,
        hinges=build_hinges(hinge_sides, free),
        couples=couples_of(_driven_faces(mesh, drive, mass)),
        torques=drive.torques_for(count) / symmetry_factor,
        contact=contact,
        probe=build_probe(kernel, last, float(mesh.radii[-1])),
        pole=int(wanted(mesh.node_sets, "pole", "node", len(points))[0]),
        chain=build_chain(points, mass, body_nodes, hinge_points, loads, drive.gravity_vector)
        if hinge_sides
        else None,
        body_of_point=body_of_point,
        touching_body=count - 1,
        contact_cells=contact_cells,
        surface=surface,
        gravity_vector=drive.gravity_vector,
        step_s=step_s,
        transit_s=float(np.ptp(points[body_nodes[-1]], axis=0).max()) / materials[-1].bar_speed,
        cell_transit_s=_smallest_size(points, cells[contact_cells]) / materials[-1].bar_speed,
    )


def _surface(mesh: meshes.FingerMesh, body_of_point: Index) -> Index:
    """Facets that may touch, all of the last phalanx."""
    facets = wanted(mesh.facet_sets, "surface", "facet")
    if (body_of_point[facets] != mesh.phalanges - 1).any():
        raise ValueError("mesh: facet set 'surface' must lie on the last phalanx alone")
    return facets


def _kernel(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    phalanx: Index,
    settings: Settings,
) -> ElementKernel:
    """The mesh's elements; phalanx (n_cells,) from 0."""
    young, poisson, density, relaxation = np.array(
        [(m.youngs_modulus, m.poisson_ratio, m.density, m.relaxation_time) for m in materials]
    )[phalanx].T.copy()
    relaxation *= np.isin(np.arange(len(mesh.cells)), mesh.relaxing)
    points, cells = mesh.points, mesh.cells
    thickness = () if mesh.dim == 3 else (chord_thickness(points, cells, mesh.radii[phalanx]),)
    elements = formulation(mesh.dim, settings.element, materials[0].law)
    return elements(points, cells, young, poisson, density, *thickness, relaxation)


def _driven_faces(
    mesh: meshes.FingerMesh, drive: Drive, mass: Array
) -> Iterator[tuple[int, int, float, Section]]:
    """For `couples_of`, first faces with torques, each followed by any reaction's face before."""
    for w in np.flatnonzero((drive.torques_for(mesh.phalanges).values != 0.0).any(axis=0)).tolist():
        faces = [(w, f"proximal_face_{w + 1}", 1.0)]
        if drive.reaction and w > 0:
            faces.append((w - 1, f"distal_face_{w}", -1.0))
        for phalanx, face, sign in faces:
            nodes = wanted(mesh.node_sets, face, "node", len(mesh.points))
            yield phalanx, w, sign, build_section(mesh.points, nodes, mass)


def _smallest_size(points: Array, cells: Index) -> float:
    """Smallest cell size, m: the geometric mean of the edges at a cell's first corner."""
    ends = cells[:, [1, 3] if points.shape[1] == 2 else [1, 3, 4]]
    edges = np.linalg.norm(points[ends] - points[cells[:, :1]], axis=2)
    return float(np.exp(np.log(edges).mean(axis=1)).min())


def formulation(dim: int, element: str | None, law: MaterialLaw) -> Callable[..., ElementKernel]:
    """The elements of that name (None: the default) and law; ValueError if there are none."""
    names = list(dict.fromkeys(name for name, _ in ELEMENTS[dim]))
    name = names[0] if element is None else element
    if name not in names:
        raise ValueError(
            f"element = {name!r}: a {dim}-dimensional mesh takes {', '.join(map(repr, names))}"
        )
    found = ELEMENTS[dim].get((name, law))
    if found is None:
        known = " or ".join(repr(own) for other, own in ELEMENTS[dim] if other == name)
        remedy = "use fem3d" if dim == 2 else "leave solver.fem.element out"
        raise ValueError(f"material.law = {law!r}: {name} elements have only {known}; {remedy}")
    return found


def _hinge_sides(
    mesh: meshes.FingerMesh,
) -> tuple[list[tuple[tuple[Index, Array], ...]], Array]:
    """Signed weights of every hinge's sides, and the hinges' rest positions (P, 2)."""
    if not any(name.startswith("hinge_") for name in mesh.node_sets):
        return [], np.zeros((0, 2))
    radii = mesh.radii

    def side(name: str, radius: float) -> tuple[Index, Array, Array]:
        nodes = wanted(mesh.node_sets, name, "node", len(mesh.points))
        try:
            nodes, weights = mean_weights(mesh.points, mesh.cells, nodes, radius)
        except ValueError as error:
            raise ValueError(f"mesh: node set '{name}': {error}") from error
        return nodes, weights, weights @ mesh.points[nodes, :2]

    size = np.ptp(mesh.points[:, 0])
    sides: list[tuple[tuple[Index, Array], ...]] = []
    centres = []
    for w in range(1, mesh.phalanges + 1):
        nodes, weights, centre = side(f"hinge_{w}_proximal", radii[w - 1])
        centres.append(centre)
        if w == 1:
            sides.append(((nodes, weights),))
            continue
        other, other_weights, other_centre = side(f"hinge_{w - 1}_distal", radii[w - 2])
        apart = np.abs(other_centre - centre).max()
        if apart > 1e-9 * size:
            raise ValueError(
                f"mesh: hinge {w} does not close: the means of 'hinge_{w - 1}_distal' and "
                f"'hinge_{w}_proximal' are {apart:.3g} m apart; they must coincide"
            )
        sides.append(((nodes, weights), (other, -other_weights)))
    return sides, np.array(centres)

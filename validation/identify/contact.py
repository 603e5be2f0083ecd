"""k and eta^2 of the reduced model's tip, from a static indentation of the meshed tip.

The last phalanx's end (three radii long, its cut held) is pressed on a frictionless rigid plane in
the direction in which the scene touches; small-strain linear elasticity, penalty contact integrated
over the surface (`reference_fem.statics.indentation`). Indentation is measured from the section
through the hemisphere's centre, moved as a rigid body: bending and shortening behind it belong to
the beam, which the reduced model already has. The choice matters: from a section one radius further
back, k is 14 % (soft finger) and 8 % (hard finger) smaller.

    k = F^2/(2 U_c)  at F = the reduced model's own peak force with that k (a fixed point, so that
                     no result of the dynamic reference enters),
    eta^2 = (dFn/d delta)/(dFt/du_t)  of the sticking contact at that force.

Uncertainty: three meshes, whose edge at the contact is a share of Hertz's contact radius; grid
convergence index, or the spread where that does not apply.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.compare.grid_convergence import NEARLY, Convergence, convergence
from validation.errors import RunFailedError, UserError
from validation.identify.reduced_tap import first_tap, stated_force, touch_angle_of
from validation.models import solid_inputs, solid_mesh
from validation.models.adapter import Progress
from validation.models.hcm import assumptions_of
from validation.scenes.load import NamedScene

# Edge at the contact over Hertz's contact radius, and its growth to the next edge: changing both
# refines the whole graded mesh, not only its middle.
MESHES = ((0.33, 1.42), (0.26, 1.32), (0.2, 1.22))
# Edges over R, and growth, for the compliance of the tip between the beam's end and the contact.
EDGES, YIELD_GROWTH = (0.1, 0.07, 0.05), 1.12
ORDER = 2.0  # of the elements
LENGTH = 3.0  # length of the modelled end over its radius
# Radius of the nodes that may touch over the contact radius, and where the patch reaches the shaft,
# along which it is longer.
REACH, SHAFT_REACH = 2.0, 4.0
CURVE = np.linspace(0.05, 1.25, 25)  # forces of the curve, over the stated one


@dataclass(frozen=True)
class Level:
    """One mesh: its edge at the contact, number of elements, and the results of pressing it."""

    edge_m: float
    elements: int
    stiffness_N_per_m: float
    eta_squared: float
    contact_radius_m: float
    indentation_m: float


@dataclass(frozen=True)
class ContactIdentification:
    """Results of the tip's static indentation.

    force_N : F at which k and eta^2 are stated.
    normal_stiffness_N_per_m, eta_squared : values on the finest mesh.
    stiffness, ratio : their convergence over the levels; None with fewer than three.
    hertz_N_per_m, mindlin_eta_squared : k after Hertz, eta^2 after Mindlin, at the same force.
    scene_normal_stiffness_N_per_m, scene_eta_squared : the scene's own tip (the paper's printed k
        in its scenes).
    touch_angle_deg : from the axis as the reduced model touches, for k and eta^2; negative towards
        the upper side. round_touch_angle_deg : as the lowest point of the round end of rigid
        phalanges does, for tip_compliance.
    levels : coarse to fine.
    tip_compliance : E R c_nn, c_nt and c_tt/cos(touch angle), by the scene's keys, of each mesh of
        `EDGES`.
    curve : force_N, indentation_m, hertz_indentation_m, each (25,), of the finest mesh.
    cautions : a patch that reaches the shaft, or is too large for linear statics; compliances that
        are not to be used.
    """

    scene: str
    force_N: float
    normal_stiffness_N_per_m: float
    eta_squared: float
    stiffness: Convergence | None
    ratio: Convergence | None
    hertz_N_per_m: float
    mindlin_eta_squared: float
    scene_normal_stiffness_N_per_m: float | None
    scene_eta_squared: float
    touch_angle_deg: float
    round_touch_angle_deg: float
    levels: tuple[Level, ...]
    tip_compliance: dict[str, tuple[float, ...]]
    curve: dict[str, tuple[float, ...]]
    cautions: tuple[str, ...]

    @property
    def yielding(self) -> dict[str, Convergence]:
        """The convergence of `tip_compliance`; empty if fewer than three meshes were solved."""
        given = self.tip_compliance.items()
        return {key: convergence(EDGES, of, ORDER) for key, of in given if len(of) == len(EDGES)}


def value_to_use(compliance: Convergence) -> float:
    """The limit of a ladder whose order is at least about the elements' own, else its finest value.

    An extrapolation by a smaller order reaches too far: from -0.33, -0.28 and -0.25 to -0.11, while
    a fourth mesh and another program have -0.25.
    """
    known = compliance.order is not None and compliance.order >= (1.0 - NEARLY) * ORDER
    return compliance.limit if known else compliance.finest


def identify_contact(
    scene: NamedScene,
    refinements: tuple[tuple[float, float], ...] = MESHES,
    progress: Progress = lambda share, text: None,
) -> ContactIdentification:
    """Identify k and eta^2 of a scene's tip.

    refinements : (edge over Hertz's contact radius, growth), coarse to fine; one is enough for k.

    Raises UserError: the scene's finger cannot be meshed with these edges, or has no round end to
        press, or its shaft is pressed rather than its end.
    Raises RunFailedError: the reduced model does not tap, or the contact's active set does not
        settle.
    """
    from hcm.contact.build import patch_cautions
    from reference_fem.contact.hertz import hertz_contact_radius, hertz_indentation, hertz_stiffness
    from reference_fem.statics.indentation import mindlin_ratio

    tables = scene.tables
    upright = 0.5 * np.pi
    touch = solid_mesh.predicted_touch(tables, 3)
    tap = first_tap(scene, touch)
    angle = float(np.clip(touch_angle_of(tap), -upright, upright))
    # the refined tip touches with its lowest point, before the end of its axis arrives
    round_angle = angle if touch is None else float(np.clip(touch.angle, -upright, upright))
    material = solid_inputs.solid_parts(tables).materials[-1]
    radius, below = tables.tip_radius, upright - abs(angle)
    peak = float(tap.summary.peak_normal_force_N)
    guess = stated_force(scene, lambda force: hertz_stiffness(material, radius, force), peak)
    contact_radius = hertz_contact_radius(material, radius, guess)
    levels: list[Level] = []
    try:
        for number, (share, growth) in enumerate(refinements):
            edge = share * contact_radius
            progress(number / len(refinements), f"edge {1e3 * edge:.3g} mm")
            tip = _tip(scene, material, angle, edge, growth, contact_radius)
            level, force, indentation = _pressed(scene, *tip, edge, guess)
            levels.append(level)
        curve = tuple(indentation(at) for at in force * CURVE)
        # the keys are those of the mirror image that touches with its lower side
        compliance = yields(scene, material, abs(round_angle), EDGES[: len(refinements)])
    except ValueError as error:
        why = "; ".join((str(error), *patch_cautions(contact_radius / radius, below)))
        raise UserError(f"scene {scene.name}: {why}") from error
    except ArithmeticError as error:
        raise RunFailedError(f"scene {scene.name}: {error}") from error
    forces = force * CURVE
    sizes = [level.edge_m for level in levels]

    def judged(name: str) -> Convergence | None:
        values = [getattr(level, name) for level in levels]
        return convergence(sizes, values, ORDER) if len(values) > 2 else None

    return ContactIdentification(
        scene=scene.name,
        force_N=force,
        normal_stiffness_N_per_m=levels[-1].stiffness_N_per_m,
        eta_squared=levels[-1].eta_squared,
        stiffness=judged("stiffness_N_per_m"),
        ratio=judged("eta_squared"),
        hertz_N_per_m=hertz_stiffness(material, radius, force),
        mindlin_eta_squared=mindlin_ratio(material.poisson_ratio),
        scene_normal_stiffness_N_per_m=tables.tip.normal_stiffness,
        scene_eta_squared=1 / tables.tangential_ratio if tables.tangential_ratio else np.inf,
        touch_angle_deg=float(np.degrees(angle)),
        round_touch_angle_deg=float(np.degrees(round_angle)),
        levels=tuple(levels),
        tip_compliance=compliance,
        curve={
            "force_N": tuple(forces),
            "indentation_m": curve,
            "hertz_indentation_m": tuple(hertz_indentation(material, radius, f) for f in forces),
        },
        cautions=(
            *patch_cautions(hertz_contact_radius(material, radius, force) / radius, below),
            *_law_cautions(scene),
            *_yield_cautions(
                upright - abs(round_angle), tables.per_phalanx(tables.finger.length)[-1] / radius
            ),
        ),
    )


def _law_cautions(scene: NamedScene) -> tuple[str, ...]:
    """Caution about a force that k does not enter."""
    if assumptions_of(scene.tables).needs_stiffness:
        return ()
    return (
        "under solver.hcm.partial_slip, one of the refined assumptions, k does not enter the"
        " reduced model: F is that model's peak, and k the spring of the same energy there",
    )


def _yield_cautions(below: float, length: float) -> tuple[str, ...]:
    """Cautions about `yields`. below : angle of the last phalanx, rad. length : its own, over R."""
    from hcm.contact.build import STEEPER
    from reference_fem.statics.yielding import PATCHES

    keys, found = "tip.compliance_nn, compliance_nt and compliance_tt", []
    if max(PATCHES) > np.sin(below):
        found.append(
            f"{keys} are those of patches up to {max(PATCHES):g} R, which reach the shaft at"
            f" {np.degrees(below):.0f} degrees: do not use them; {STEEPER}"
        )
    if length < LENGTH:
        found.append(
            f"{keys} depend on the hinge's face, held and nearer to the tip than {LENGTH:g} R: use"
            " those of a finger whose last phalanx is that long or longer"
        )
    return tuple(found)


def _pressed(
    scene: NamedScene, elements: int, tip: Any, edge: float, guess: float
) -> tuple[Level, float, Callable[[float], float]]:
    """A mesh's stiffnesses at the force that it has as the tap turns back, N, and its indentation,
    m, at other forces.
    """
    from reference_fem.statics.indentation import contact_area, indent

    area = contact_area(tip)
    force = stated_force(scene, lambda at: indent(tip, area, at).stiffness_N_per_m, guess)
    pressed = indent(tip, area, force)
    if pressed.eta_squared <= 0.0:
        raise ValueError(
            f"force = {force:g} N: the tangential stiffness is negative, as most of the patch lies"
            " behind the section from which motion is measured"
        )
    level = Level(
        edge,
        elements,
        pressed.stiffness_N_per_m,
        pressed.eta_squared,
        pressed.contact_radius_m,
        pressed.indentation_m,
    )
    return level, force, lambda at: indent(tip, area, at).indentation_m


def yields(
    scene: NamedScene, material: Any, angle: float, edges: tuple[float, ...]
) -> dict[str, tuple[float, ...]]:
    """The tip's own compliance on meshes with these edges over R, by the scene's keys."""
    from reference_fem.statics.yielding import tip_yield

    radius = scene.tables.tip_radius
    found = [
        tip_yield(_end(scene, angle, edge * radius, YIELD_GROWTH, 4.0), material, angle)
        for edge in edges
    ]
    return {
        "tip.compliance_nn": tuple([c.nn for c in found]),
        "tip.compliance_nt": tuple([c.nt for c in found]),
        "tip.compliance_tt": tuple([c.tt / np.cos(angle) for c in found]),
    }


def _tip(
    scene: NamedScene, material: Any, angle: float, edge: float, growth: float, contact: float
) -> tuple[int, Any]:
    """Number of elements (full body) of the last phalanx's end; its compliance at the contact."""
    from reference_fem.statics.tip import tip_compliance

    mesh = _end(scene, angle, edge, growth, 3.0)
    shaft = contact > scene.tables.tip_radius * np.cos(angle)
    tip = tip_compliance(mesh, material, angle, (SHAFT_REACH if shaft else REACH) * contact)
    return tip.symmetry_factor * len(mesh.cells), tip


def _end(scene: NamedScene, angle: float, edge: float, growth: float, sections: float) -> Any:
    """A mesh of the last phalanx's end, its sections R/`sections` apart."""
    import meshes

    tables = scene.tables
    length, radius = tables.per_phalanx(tables.finger.length)[-1], tables.tip_radius
    sizing = meshes.Sizing(
        section_size=radius / (sections + 2),
        axial_size=radius / sections,
        tip_size=edge,
        contact_angle=angle,
        growth=growth,
    )
    geometry = meshes.FingerGeometry((min(length, LENGTH * radius),), (2 * radius,))
    return meshes.finger_hexahedra(geometry, sizing)

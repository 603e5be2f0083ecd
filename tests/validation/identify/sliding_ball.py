"""A half-ball on a rod that is pressed on a plane and slides on it, by statics in three dimensions.

E = R = 1; half a body of trilinear hexahedra with the mean dilatation, small strains, the law of
St. Venant and Kirchhoff or the neo-Hookean one; penalty contact over the facets, friction along the
plane of motion.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

import hcm
import meshes
from hcm.assembly.statics import equilibrium
from hcm.beam.chain import build_chain
from hcm.beam.joint_torque import torque_force
from hcm.beam.refinement import beams_of, refine_chain
from hcm.parameters import NEO_HOOKE, MaterialLaw
from reference_fem.elements.geometry import geometries
from reference_fem.settings import Material
from reference_fem.statics.indentation import contact_area
from reference_fem.statics.tip import last_phalanx, tip_compliance, touch_frame
from tests.validation.identify.half_ball import assembled, factorized, neo_hooke

Numbers = NDArray[np.float64]
LENGTH, PENALTY, EDGES = 2.5, 1500.0, 5  # edges: over the patch
FIRST, LATER, STEPS = 0.35, (0.7, 1.0), 40  # shares of the force, and Newton's iterations


class SlidingBall:
    """The body, and what one plane's push and friction make of it."""

    def __init__(self, nu: float, degrees: float, patch: float) -> None:
        self.nu, self.angle = nu, np.radians(90.0 - degrees)
        self.force = 4 / 3 / (1 - nu**2) * patch**3
        sizes = meshes.Sizing(
            section_size=1 / 4.5, axial_size=1 / 3.5, tip_size=patch / EDGES,
            contact_angle=self.angle, growth=1.3,
        )  # fmt: skip
        mesh = meshes.finger_hexahedra(meshes.FingerGeometry((LENGTH,), (2.0,)), sizes)
        _, body = last_phalanx(mesh)
        made = list(geometries(body.points, body.cells))
        self.gradient = np.concatenate([np.asarray(g.gradients) for g in made])
        self.weight = np.concatenate([np.asarray(g.weights) for g in made])
        self.cells, self.size = body.cells, 3 * len(body.points)
        self.places = (3 * body.cells[:, :, None] + np.arange(3)).reshape(-1, 24)
        held = (3 * body.node_sets["proximal_face_1"][:, None] + np.arange(3)).ravel()
        held = np.append(held, 3 * body.node_sets["symmetry"] + 2)
        self.free = np.setdiff1d(np.arange(self.size), held)
        tip = tip_compliance(mesh, Material(1.0, nu, 1.0), self.angle, 2.2 * patch)
        self.area = contact_area(tip)
        rows = np.repeat(np.arange(len(tip.nodes)), 3)
        columns = (3 * tip.nodes[:, None] + np.arange(3)).ravel()
        _, _, _, frame = touch_frame(body, self.angle)
        self.inward, self.along = (
            sp.csr_matrix(
                (np.tile(d, len(tip.nodes)), (rows, columns)), (len(tip.nodes), self.size)
            )
            for d in frame[:2]
        )
        self.frame = frame[:2, :2]

    def internal(self, u: Numbers, law: MaterialLaw | None) -> tuple[Numbers, Any]:
        """Forces of W = mu E:E + lam/2 mean(tr E)^2, or neo-Hookean, and their tangent."""
        finite = law is not None
        lam, mu = self.nu / ((1 + self.nu) * (1 - 2 * self.nu)), 0.5 / (1 + self.nu)
        turned = np.einsum("eai,eqaj->eqij", u.reshape(-1, 3)[self.cells], self.gradient)
        volume = self.weight.sum(axis=1)
        if law == NEO_HOOKE:
            return self._neo_hookean(np.eye(3) + turned, volume, lam, mu)
        strain = 0.5 * (turned + turned.swapaxes(-1, -2))
        full = np.broadcast_to(np.eye(3), turned.shape)
        if finite:
            strain, full = strain + 0.5 * turned.swapaxes(-1, -2) @ turned, np.eye(3) + turned
        mean = np.einsum("eq,eqii->e", self.weight, strain) / volume
        stress = 2 * mu * strain + lam * mean[:, None, None, None] * np.eye(3)
        rate = np.einsum("eqki,eqaj->eqakij", full, self.gradient)
        rate = (0.5 * (rate + rate.swapaxes(-1, -2))).reshape(*self.weight.shape, 24, 3, 3)
        out = np.zeros(self.size)
        np.add.at(out, self.places, np.einsum("eq,eqij,eqdij->ed", self.weight, stress, rate))
        flat = (rate * np.sqrt(self.weight)[:, :, None, None, None]).swapaxes(1, 2)
        flat = flat.reshape(len(volume), 24, -1)
        swell = np.einsum("eq,eqdii->ed", self.weight, rate)
        blocks = 2 * mu * flat @ flat.swapaxes(1, 2)
        blocks += lam * swell[:, :, None] * swell[:, None, :] / volume[:, None, None]
        if finite:
            g, s = self.gradient, stress
            own = np.einsum("eq,eqai,eqij,eqbj->eab", self.weight, g, s, g)
            blocks += np.einsum("eab,ij->eaibj", own, np.eye(3)).reshape(blocks.shape)
        return out, assembled(blocks, self.places, self.size)

    def _neo_hookean(
        self, full: Numbers, volume: Numbers, lam: float, mu: float
    ) -> tuple[Numbers, Any]:
        """The same of p = lam/2 (J' - 1/J'), J' the mean of det F."""
        mean = np.einsum("eq,eq->e", self.weight, np.linalg.det(full)) / volume
        pressure = np.broadcast_to(0.5 * lam * (mean - 1 / mean)[:, None], self.weight.shape)
        gradient = np.einsum("eqaj,ik->eqakij", self.gradient, np.eye(3))
        gradient = gradient.reshape(*self.weight.shape, 24, 3, 3)
        own, blocks, swell = neo_hooke(full, gradient, self.weight, pressure, mu)
        whole = np.einsum("eq,eqd->ed", self.weight, swell)
        slope = 0.5 * lam * (1 + mean**-2) / volume
        blocks += slope[:, None, None] * whole[:, :, None] * whole[:, None, :]
        out = np.zeros(self.size)
        np.add.at(out, self.places, own)
        return out, assembled(blocks, self.places, self.size)

    @property
    def hertz(self) -> float:
        """Hertz's indentation at `force`."""
        return (0.75 * (1 - self.nu**2) * self.force) ** (2 / 3)

    def approach(self, friction: float, law: MaterialLaw | None) -> float:
        """Of the plane at the whole body's `force`; friction > 0 slides towards the hinge."""
        u, depth = np.zeros(self.size), self.hertz
        for share in (FIRST, *LATER):
            u, depth = self._settled(u, depth, share * self.force, friction, law)
        return depth

    def stuck(self, law: MaterialLaw | None, shares: Numbers) -> Numbers:
        """du/dF along the plane, which has pressed the body by shares of `force` without friction
        and sticks to it as it moves on; the force stays.
        """
        u, depth, free = np.zeros(self.size), self.hertz, self.free
        ways, found = (self.inward, self.along), []
        for share in shares:
            u, depth = self._settled(u, depth, share * self.force, 0.0, law)
            springs = sp.csr_matrix(self._springs(self._gap(u, depth)))
            matrix = self.internal(u, law)[1] + sum(way.T @ springs @ way for way in ways)
            whole = springs @ np.ones(springs.shape[1])
            sides = np.stack([way.T @ whole for way in ways], axis=1)[free]
            moved = factorized(matrix[free][:, free]).solve(sides)
            compliance = np.linalg.inv(2 * (whole.sum() * np.eye(2) - sides.T @ moved))
            found.append(compliance[1, 1])
        return np.array(found)

    def _gap(self, u: Numbers, depth: float) -> Numbers:
        """How far each point of the area is pressed into the plane's springs."""
        return np.asarray(depth - self.area.heights - self.area.shapes @ (self.inward @ u))

    def _springs(self, gap: Numbers) -> Numbers:
        """The plane's springs that are pressed, between the nodes of the area."""
        shapes = self.area.shapes
        return (shapes.T * (PENALTY * self.area.weights * (gap > 0))) @ shapes

    def _settled(
        self, u: Numbers, depth: float, force: float, friction: float, law: MaterialLaw | None
    ) -> tuple[Numbers, float]:
        shapes, area, free = self.area.shapes, self.area.weights, self.free
        for step in range(STEPS):
            gap = self._gap(u, depth)
            assert not (self.area.outermost & (gap > 0)).any()
            push = shapes.T @ (PENALTY * area * np.maximum(gap, 0.0))
            out, tangent = self.internal(u, law)
            pulls = self.inward.T - friction * self.along.T
            out, missing = out - pulls @ push, 2 * push.sum() - force
            if step and np.abs(out[free]).max() + abs(missing) < 1e-7 * force:
                return u, depth
            springs = self._springs(gap)
            whole = tangent + pulls @ sp.csr_matrix(springs) @ self.inward
            sides = np.stack([-out[free], (pulls @ springs.sum(axis=1))[free]], axis=1)
            moved = factorized(whole[free][:, free]).solve(sides)
            felt = 2 * (self.inward.T @ springs.sum(axis=0))[free]
            deeper = (felt @ moved[:, 0] - missing) / (2 * springs.sum() - felt @ moved[:, 1])
            u[free] += moved[:, 0] + deeper * moved[:, 1]
            depth += deeper
        raise ArithmeticError(f"no equilibrium at F = {force:g}")

    def compliance(self, friction: float, law: MaterialLaw | None) -> float:
        """c of u = c F between the plane and C, Hertz's indentation and the beam's way off."""
        load = 1.0 if law else 1e-4  # of a beam that bends as linearly as the solid
        beam = self._beam(load * self.force, -friction * load * self.force) / load
        return (self.approach(friction, law) - self.hertz - beam) / self.force

    def _beam(self, push: float, pull: float) -> float:
        """Way of the refined beam's C into the body, held where the solid is."""
        finger = hcm.Finger((hcm.Phalanx(LENGTH, 2.0, 1.0, 1.0, 8, poisson_ratio=self.nu),))
        refined, still = hcm.Assumptions("refined"), hcm.Drive(gravity=0.0)
        chain, rest = build_chain(beams_of(finger, refined), still)
        chain = refine_chain(chain, finger, still, refined)
        load, q, tip = np.zeros_like(rest), rest, chain.tip
        load[tip : tip + 2] = push * self.frame[0] + pull * self.frame[1]
        for _ in range(30):
            load[tip + 2 : tip + 4] = torque_force(pull, q[tip + 2], q[tip + 3])
            before, q = q, equilibrium(chain, rest, np.arange(6), load)
            if np.abs(q - before).max() < 1e-12:
                break
        return float(self.frame[0] @ (q - rest)[tip : tip + 2])

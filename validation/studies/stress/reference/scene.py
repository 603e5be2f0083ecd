"""A cell of the reference's maps: a small body that hits the plane, and its run."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

import meshes
import reference_fem as rf
from meshes.topology import outer_facets, structured
from reference_fem.dynamics.loop import explicit_tap
from reference_fem.dynamics.state import LoopState
from reference_fem.dynamics.step import start_state
from reference_fem.model import Model, build_model

Body = Literal["block", "finger"]
SIDE = 0.02  # m, of the block
FINGER_LENGTH, FINGER_DIAMETER = 0.03, 0.015  # m
# The coarsest finger whose section and tip still have a core and a ring.
FINGER_SIZES = meshes.Sizing(section_size=5e-3, axial_size=5e-3, tip_size=5e-3)
# The finger's angle below the horizontal where it starts, and that at which its hinge lies H above
# the plane with 3 mm to spare, rad.
START_ANGLE, TOUCH_ANGLE, SPARE = 0.3, 0.6, 0.003
DENSITY = 1000.0
# Longest contact, in transits of a bar's wave over the block: twenty times that of a hard contact.
LONGEST = 100.0
MAX_STEPS = 100_000
# Fields kept: more than the audits of a tap, so that momentum is known at each of them.
FIELDS = 400


@lru_cache(maxsize=64)
def block(dim: int, divisions: int, distortion: float = 0.0, seed: int = 0) -> meshes.FingerMesh:
    """A cube (half of it, Z >= 0) or a square plate about the origin; all of its outside may touch.

    Interior nodes are moved in each direction by up to the share `distortion` of an edge, evenly
    distributed; those on the outside stay.
    """
    axes = [np.linspace(-SIDE / 2, SIDE / 2, divisions + 1)] * 2
    if dim == 3:
        axes = [*axes, np.linspace(0.0, SIDE / 2, divisions // 2 + 1)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:-1])
    cells = structured(number)
    points, skin = grid.reshape(-1, dim), outer_facets(cells)
    moves = np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape) * SIDE / divisions
    moves[skin] = 0.0
    points = points + distortion * moves
    sets = {"pole": np.array([number[0, divisions // 2].flat[0]])}
    skin = skin[np.lexsort(np.sort(skin, axis=1).T[::-1])]
    if dim == 3:
        sets["symmetry"] = np.flatnonzero(points[:, 2] == 0.0)
        skin = skin[~(points[skin][..., 2] == 0.0).all(axis=1)]
    return meshes.FingerMesh(
        points, cells, sets, {"surface": skin}, {"phalanx_1": np.arange(len(cells))}
    )


@lru_cache(maxsize=4)
def finger(dim: int) -> meshes.FingerMesh:
    """One phalanx with a round end, hinged at the origin."""
    geometry = meshes.FingerGeometry((FINGER_LENGTH,), (FINGER_DIAMETER,))
    build = meshes.finger_hexahedra if dim == 3 else meshes.finger_quadrilaterals
    return build(geometry, FINGER_SIZES)


@dataclass(frozen=True)
class ReferenceScene:
    """A block that falls and slides, or a finger that swings down about its hinge.

    body, dim, divisions, distortion, seed : see `block` and `finger`
    modulus, poisson : E, Pa, and ν; ρ is 1000 kg/m³.
    speed : of the block and of the finger's end, m/s, normal to the surface (block)
    slide : the block's speed along the surface over that normal to it
    tilt : rotation of the block, rad: 0 falls flat
    friction : μ
    contact, stiffness : contact law and its factor: the `penalty_factor`, or `surface_factor` over
        10,000
    element, step_factor : as in `reference_fem.Settings`
    """

    body: Body = "block"
    dim: int = 3
    divisions: int = 4
    distortion: float = 0.0
    seed: int = 0
    modulus: float = 1e7
    poisson: float = 0.3
    speed: float = 1.0
    slide: float = 0.5
    tilt: float = 0.1
    friction: float = 0.3
    contact: str = "impulse"
    stiffness: float = 0.1
    element: str | None = None
    step_factor: float = 0.9

    @property
    def material(self) -> rf.Material:
        """The body's material."""
        return rf.Material(self.modulus, self.poisson, DENSITY)

    @property
    def settings(self) -> rf.Settings:
        """The run's settings."""
        return rf.Settings(
            contact=self.contact,  # type: ignore[arg-type]
            penalty_factor=self.stiffness,
            surface_factor=1e4 * self.stiffness,
            element=self.element,
            step_factor=self.step_factor,
            threads=1,
            max_contact_time_s=LONGEST * SIDE / self.material.bar_speed,
            max_steps=MAX_STEPS,
            snapshots=FIELDS,
        )

    def simulate(self) -> tuple[rf.TapResult, Model]:
        """Run the scene; returns the result, and the model that its fields are judged with."""
        return self._swing() if self.body == "finger" else self._fall()

    def _swing(self) -> tuple[rf.TapResult, Model]:
        mesh, drive, given = finger(self.dim), rf.Drive(), (self.material,)
        surface = rf.Surface(FINGER_LENGTH * math.sin(TOUCH_ANGLE) + SPARE, self.friction)
        rate = self.speed / FINGER_LENGTH
        start = rf.ChainState(np.array([START_ANGLE]), np.array([rate]), 0.0)
        result = rf.simulate(mesh, given, surface, drive, self.settings, start=start)
        return result, build_model(mesh, given, surface, drive, self.settings)

    def _fall(self) -> tuple[rf.TapResult, Model]:
        mesh: meshes.FingerMesh = block(self.dim, self.divisions, self.distortion, self.seed)
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        turn = np.eye(self.dim)
        turn[:2, :2] = (c, -s), (s, c)
        u = mesh.points @ turn.T - mesh.points
        v = np.zeros_like(u)
        v[:, :2] = self.slide * self.speed, -self.speed
        lowest = float((mesh.points + u)[:, 1].min())
        lead = self.speed * SIDE / self.material.bar_speed / 20.0
        surface = rf.Surface(lead - lowest, self.friction)
        model = build_model(mesh, (self.material,), surface, rf.Drive(), self.settings)
        start = LoopState(start_state(model, u, v, 0.0), 0.0, origin_energy_J=None)
        return explicit_tap(model, self.settings, start), model

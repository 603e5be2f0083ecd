"""Where a falling finger touches, and how hard: by its rigid chain and Hertz's law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import meshes
from reference_fem.model import build_model
from reference_fem.rigid_chain import ChainState, chain_and_start
from reference_fem.settings import Drive, Material, Settings, Surface


@dataclass(frozen=True)
class Touch:
    """A prediction before anything is solved, good to some 5 % in the patch on the paper's fingers.

    angle : between the last phalanx's axis and the direction to the surface, rad (`touch_angle`)
    speed : of the lowest point towards the surface, m/s; at least 0.
    mass : that it meets the surface with, kg
    force, patch_radius : Hertz's at the turn, N and m
    """

    angle: float
    speed: float
    mass: float
    force: float
    patch_radius: float


def touch_angle(axis: float) -> float:
    """Between the last phalanx's axis and the direction to the surface, rad, -π to π.

    A ball that lies `axis` below the horizontal, rad, touches π/2 - axis off its axis; beyond the
    vertical with its upper side, which is negative. It may have whirled. An end that points up has
    an angle beyond π/2: then the rim at the hinge touches.
    """
    return math.remainder(0.5 * math.pi - axis, 2.0 * math.pi)


def predicted_touch(
    mesh: meshes.FingerMesh,
    materials: Sequence[Material],
    surface: Surface,
    drive: Drive,
    state: ChainState,
) -> Touch:
    """The touch of the finger of `mesh` in a rigid state at the surface.

    With the mobility G of the ball's lowest point (`RigidChain.mobility`) and friction in gross
    slip, F_t = r F_n, r = -μ sgn v_x, the point meets the surface with the mass m = 1/(G_yy + r
    G_yx), or with 1/G_yy where that is not positive (Painlevé's jamming).
    Hertz's ball of that mass turns where (Johnson, Contact Mechanics, 11.4.1)

        ½ m v² = 2/5 k δ^(5/2),  k = 4/3 E* sqrt(R),  F = k δ^(3/2),  a = sqrt(R δ)
    """
    model = build_model(mesh, materials, surface, drive, Settings())
    chain, _ = chain_and_start(model.chain, None)
    last = model.body_of_point == chain.links - 1
    radius = float(np.abs(model.points[last, 1]).max())
    axis = float(state.angles[-1])
    reach = float(np.ptp(model.points[last, 0])) - radius
    hinge = chain.hinges_at(state.angles, state.rates)[0][-1]
    lowest = hinge - reach * np.array([math.cos(axis), math.sin(axis)]) - [0.0, radius]
    if math.sin(axis) < 0.0:
        down = math.copysign(radius, math.cos(axis))
        lowest = hinge + down * np.array([math.sin(axis), -math.cos(axis)])
    mobility, velocity = chain.mobility(state, lowest)
    slip = -surface.friction * float(np.sign(velocity[0]))
    yielding = float(mobility[1, 1] + slip * mobility[1, 0])
    if yielding <= 0.0:
        yielding = float(mobility[1, 1])
    mass = model.copies / yielding
    speed = max(0.0, -float(velocity[1]))
    stiffness = 4.0 / 3.0 * materials[-1].plane_strain_modulus * math.sqrt(radius)
    approach = (1.25 * mass * speed**2 / stiffness) ** 0.4
    return Touch(
        angle=touch_angle(axis),
        speed=speed,
        mass=mass,
        force=stiffness * approach**1.5,
        patch_radius=math.sqrt(radius * approach),
    )

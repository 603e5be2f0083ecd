"""Bodies that are thrown or let go, and the taps of fingers, for the reference's tests."""

from typing import Any

import numpy as np

import meshes
import reference_fem as rf
from reference_fem.dynamics.loop import explicit_tap
from reference_fem.dynamics.state import LoopState
from reference_fem.dynamics.step import start_state
from reference_fem.model import Model, build_model

SOFT = (rf.Material(1e9, 0.4, 1400.0),) * 3
SURFACE = rf.Surface(0.1, 0.5)
GEOMETRY = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3)
FAR = rf.Surface(10.0, 0.5)


def body(
    mesh: meshes.FingerMesh,
    material: rf.Material,
    surface: rf.Surface = FAR,
    settings: rf.Settings | None = None,
    torques: tuple[float, ...] = (),
    gravity: float = 0.0,
    **drive: Any,
) -> Model:
    """Phalanges of one material; by default nothing is in their reach."""
    driven = rf.Drive(torques, gravity, **drive)
    materials = (material,) * mesh.phalanges
    return build_model(mesh, materials, surface, driven, settings or rf.Settings())


def throw(
    model: Model, settings: rf.Settings, velocity: Any, displacement: Any = 0.0
) -> rf.TapResult:
    """The explicit tap from a velocity and a displacement: in X and Y, or (nodes, dim)."""
    v, u = np.zeros_like(model.points), np.zeros_like(model.points)
    v[:, : np.shape(velocity)[-1]] = velocity
    u += displacement
    start = LoopState(start_state(model, u, v, 0.0), 0.0, origin_energy_J=None)
    return explicit_tap(model, settings, start)


def tap(
    mesh: meshes.FingerMesh,
    materials: tuple[rf.Material, ...] = SOFT,
    surface: rf.Surface = SURFACE,
    drive: rf.Drive | None = None,
    start: rf.ChainState | None = None,
    progress: Any = None,
    restart: rf.Restart | None = None,
    **settings: Any,
) -> rf.TapResult:
    """A finger's first tap, by default the paper's soft one's."""
    scene = (mesh, materials, surface, drive or rf.Drive(), rf.Settings(**settings))
    return rf.simulate(*scene, start=start, progress=progress, restart=restart)

"""Remove gmsh's rounding: nodes lie on the surfaces, planes and axes that they belong to."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from meshes.arrays import Floats, Ints
from meshes.errors import MeshError
from meshes.phalanx import PhalanxBlocks
from meshes.plan import PhalanxPlan

_TOLERANCE = 1e-6
"""Largest distance of y from 0 over the radius at which a node counts as lying on y = 0."""


def snap(phalanx: PhalanxBlocks, plan: PhalanxPlan) -> Floats:
    """Positions (n, dim) in mm, moved by gmsh's rounding only.

    Nodes of holes go to the shafts' cylinders, lateral nodes to the phalanx's, tip nodes to the
    sphere, end faces to their planes, the symmetry plane to z = 0; the hinge patches are made
    mirror images about y = 0, so that their mean lies on the hinge axis; the pole goes to the axis.
    """
    points = phalanx.points.copy()
    roles = phalanx.roles
    points[np.abs(points[:, 1]) < _TOLERANCE * plan.radius, 1] = 0.0
    if "symmetry" in roles:
        points[roles["symmetry"], 2] = 0.0
    for hole, x in (("proximal_hole", 0.0), ("distal_hole", -plan.shaft)):
        if hole in roles:
            axis = np.array([x, 0.0])
            arm = points[roles[hole], :2] - axis
            arm *= plan.hole / np.linalg.norm(arm, axis=1, keepdims=True)
            points[roles[hole], :2] = axis + arm
    points[roles["proximal_face"], 0] = 0.0
    _mirror(points, roles["proximal_face"], plan.radius)
    if plan.rounded:
        end = -plan.shaft - plan.radius
    else:
        points[roles["distal_face"], 0] = end = -plan.shaft
        _mirror(points, roles["distal_face"], plan.radius)
    holes = [roles[name] for name in ("proximal_hole", "distal_hole") if name in roles]
    in_hole = np.isin(roles["shaft"], np.concatenate([*holes, np.empty(0, np.int64)]))
    shaft, rim = roles["shaft"][~in_hole], roles["shaft"][in_hole]
    points[shaft, 1:] *= plan.radius / np.linalg.norm(points[shaft, 1:], axis=1, keepdims=True)
    if rim.size:  # on both cylinders: the hole fixes x and y
        points[rim, 2] = np.sqrt(plan.radius**2 - points[rim, 1] ** 2)
    if plan.rounded:
        sphere = roles["sphere"]
        centre = np.zeros(points.shape[1])
        centre[0] = -plan.shaft
        arm = points[sphere] - centre
        arm *= plan.radius / np.linalg.norm(arm, axis=1, keepdims=True)
        points[sphere] = centre + arm
    if "pole" in roles:
        points[roles["pole"]] = 0.0
        points[roles["pole"], 0] = end
    return points


def _mirror(points: Floats, face: Ints, radius: float) -> None:
    """Make the nodes of an end face mirror images about y = 0, in place."""
    upper = face[points[face, 1] > 0.0]
    lower = face[points[face, 1] < 0.0]
    reflected = points[lower] * np.where(np.arange(points.shape[1]) == 1, -1.0, 1.0)
    distance, nearest = cKDTree(reflected).query(points[upper])
    if len(upper) != len(lower) or distance.max() > _TOLERANCE * radius:
        raise MeshError("gmsh returned an end face that is not symmetric about the hinge axis")
    mean = 0.5 * (points[upper] + reflected[nearest])
    points[upper] = mean
    mean[:, 1] *= -1.0
    points[lower[nearest]] = mean

"""Meshes of the finger: hexahedra in 3D, quadrilaterals in 2D, by gmsh's transfinite blocks."""

from meshes.errors import MeshError
from meshes.files import read, write
from meshes.finger import finger_hexahedra, finger_quadrilaterals
from meshes.finger_check import check_finger
from meshes.geometry import FingerGeometry
from meshes.mesh import FingerMesh
from meshes.mirror import mirrored
from meshes.plan import count_elements
from meshes.sizing import SIZINGS, Sizing

__all__ = [
    "SIZINGS",
    "FingerGeometry",
    "FingerMesh",
    "MeshError",
    "Sizing",
    "check_finger",
    "count_elements",
    "finger_hexahedra",
    "finger_quadrilaterals",
    "mirrored",
    "read",
    "write",
]

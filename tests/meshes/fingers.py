"""The paper's finger and a mesh with a fine tip, for the tests of meshes."""

import meshes

L, D = 0.04, 0.015
R = D / 2
PAPER = meshes.FingerGeometry((L,) * 3, (D,) * 3)
BUILD = {3: meshes.finger_hexahedra, 2: meshes.finger_quadrilaterals}
FINE_TIP = meshes.Sizing(section_size=1.5e-3, axial_size=2e-3, tip_size=1e-4)

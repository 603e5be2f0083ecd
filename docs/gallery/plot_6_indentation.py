"""
An indentation
==============

The meshed fingertip is pressed on the plane by linear statics. Force over approach, and the linear
spring with the same energy at the same force, are shown beside Hertz's. No single spring is right:
k grows with the force (and scatters by 10 % here: the mesh is coarse).
`fingertap identify contact soft` refines the mesh, and finds the k of a scene's tap.
"""

import math

import numpy as np
from matplotlib import pyplot as plt

import meshes
import reference_fem as fem
from reference_fem.contact.hertz import hertz_indentation, hertz_stiffness
from reference_fem.statics.indentation import contact_area, indent
from reference_fem.statics.tip import tip_compliance

radius, angle = 7.5e-3, math.radians(40)  # of the sphere; of the touch from its axis
material = fem.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1400.0)
geometry = meshes.FingerGeometry((3 * radius,), (2 * radius,))
sizing = meshes.Sizing(
    section_size=radius / 4, axial_size=radius / 2, tip_size=2.5e-4, contact_angle=angle, growth=1.5
)
mesh = meshes.finger_hexahedra(geometry, sizing)
tip = tip_compliance(mesh, material, angle, reach=1.3e-3)
area = contact_area(tip)
print(f"{len(mesh.cells)} elements, {len(tip.nodes)} nodes that may touch")

forces = np.array([10.0, 20.0, 40.0, 60.0, 80.0, 100.0])
loads = [indent(tip, area, force) for force in forces]
fine = np.linspace(1.0, 105.0, 100)
hertz = np.array([hertz_indentation(material, radius, force) for force in fine])

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.4), layout="constrained")
left.plot(1e6 * hertz, fine, "k--", label="Hertz")
left.plot([1e6 * load.indentation_m for load in loads], forces, "o", label="finite elements")
left.set(xlabel="approach (µm)", ylabel="force (N)")
left.legend()
right.plot(fine, [1e-6 * hertz_stiffness(material, radius, force) for force in fine], "k--")
right.plot(forces, [1e-6 * load.stiffness_N_per_m for load in loads], "o")
right.set(xlabel="force (N)", ylabel="k (N/µm)")
plt.show()

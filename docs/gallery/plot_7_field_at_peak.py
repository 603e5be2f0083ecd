"""
A field at peak force
=====================

The von Mises stress of the soft finger at the instant of the largest force, cut along the plane of
motion: a solid run keeps its fields as snapshots, which PyVista draws and ParaView opens.
"""

import pyvista as pv
from matplotlib import pyplot as plt

import meshes
import reference_fem as fem

mesh = meshes.finger_hexahedra(
    meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3), meshes.SIZINGS["fast"]
)
material = fem.Material(youngs_modulus=1e9, poisson_ratio=0.4, density=1400.0)
result = fem.simulate(mesh, (material,) * 3, fem.Surface(0.1, 0.5), fem.Drive(), fem.Settings())
peak = next(snapshot for snapshot in result.snapshots if snapshot.at_peak)
print(f"{result.summary.peak_normal_force_N:.1f} N at {1e3 * peak.time_s:.2f} ms")
print(*result.cautions, sep="\n")

grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: mesh.cells}, mesh.points + peak.displacement)
grid.cell_data["stress"] = peak.von_mises_Pa / 1e6
half = grid.reflect((0.0, 0.0, 1.0))  # the cut faces the camera

plotter = pv.Plotter(off_screen=True, window_size=(1200, 800))
limits = (0.0, 3.0)  # MPa; exceeded under the contact
plotter.add_mesh(half, show_edges=True, cmap="viridis", clim=limits, show_scalar_bar=False)
plotter.set_background("white")
plotter.enable_parallel_projection()
plotter.view_xy()
plotter.set_focus(half.points[half.points[:, 1].argmin()] + [0.012, 0.01, 0.0])
plotter.camera.parallel_scale = 0.014  # half of the picture's height, m

figure, axis = plt.subplots(figsize=(8, 4.7), layout="constrained")
axis.imshow(plotter.screenshot(return_img=True))
axis.set_axis_off()
shown = plt.cm.ScalarMappable(plt.Normalize(*limits), "viridis")
figure.colorbar(shown, ax=axis, label="von Mises stress (MPa)", extend="max", shrink=0.8)
plotter.close()
plt.show()

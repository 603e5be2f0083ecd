"""
A sweep with an error map
=========================

Where are the paper's assumptions good enough? Friction and stiffness vary over a grid, and each
scene is solved with the paper's and with the refined assumptions, on all cores. With the finite
elements among its models, `fingertap sweep PLAN.toml` draws the same map against the reference.
"""

from dataclasses import replace

import numpy as np
from matplotlib import pyplot as plt

import hcm

friction, modulus = np.linspace(0.0, 1.2, 5), np.geomspace(5e8, 4e10, 6)
grid = [values.ravel() for values in np.meshgrid(friction, modulus)]
changes = {
    "surface.friction": grid[0],
    "phalanx.youngs_modulus": grid[1],
    "tip.normal_stiffness": 0.78e6 * (grid[1] / 1e9) ** 0.63,  # through the paper's two fingers
}

finger = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, 5, poisson_ratio=0.4),) * 3)
paper = hcm.Scene(finger, hcm.Surface(height=0.1, friction=0.5), hcm.Tip(normal_stiffness=0.78e6))
refined = replace(paper, assumptions=hcm.Assumptions("refined"))

peaks = {}
for name, scene in (("paper", paper), ("refined", refined)):
    table = hcm.simulate_many(hcm.vary(scene, changes), accuracy=1e-2)
    print(f"{name}: {int((table.status == 'COMPLETED').sum())} of {table.sizes['scene']} completed")
    peaks[name] = table["peak_normal_force_N"].values.reshape(modulus.size, friction.size)

error = 100 * (peaks["paper"] / peaks["refined"] - 1)
figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
shown = axis.pcolormesh(friction, modulus, error, cmap="RdBu_r", vmin=-60, vmax=60)
axis.set(yscale="log", xlabel="friction", ylabel="Young's modulus (Pa)")
figure.colorbar(shown, label="peak force, paper over refined (%)")
plt.show()

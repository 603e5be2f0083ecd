"""
A scene of your own
===================

A scene is TOML in SI units. `fingertap new NAME.toml` writes one with every key explained. Here it
is in the program: two phalanges of unequal length above a slope, released 29 degrees down.
"""

import tempfile
from pathlib import Path

from matplotlib import pyplot as plt

from validation.models import adapter
from validation.scenes.load import load_scene

SCENE = """
[finger]
phalanges = 2
length = [0.05, 0.03]
diameter = 0.012
elements = 8

[material]
youngs_modulus = 2e9
density = 1200.0
poisson_ratio = 0.4

[surface]
height = 0.06
friction = 0.4
incline = 0.1

[tip]
normal_stiffness = 1.2e6
restitution = 0.9

[start]
angles = 0.5
"""

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "own.toml"
    path.write_text(SCENE, encoding="utf-8")
    scene = load_scene(str(path))
record = adapter("hcm").run(scene).record
print(f"{record.status}: {record.value('peak_normal_force_N'):.1f} N")

time = 1e3 * (record.history["time_s"] - record.value("contact_time_s"))
figure, axis = plt.subplots(figsize=(6, 3.4), layout="constrained")
axis.plot(time, record.history["normal_force_N"], label="$F_n$")
axis.plot(time, record.history["tangential_force_N"], label="$F_t$")
axis.set(xlim=(-0.02, 1.1e3 * record.value("contact_duration_s")), xlabel="$t - t_c$ (ms)")
axis.set_ylabel("contact force (N)")
axis.legend()
plt.show()

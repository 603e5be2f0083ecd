"""
A model of your own
===================

A model is an object with a name, a kind and a `run` that returns its force curves. This one is the
plug-in of `docs/plugin-example`, a rigid rod on a linear spring. Once installed with pip, it runs
with `fingertap run soft --model mine` and is compared by `fingertap validate --models hcm,mine`.
"""

import sys
from pathlib import Path

from matplotlib import pyplot as plt

import validation
from validation.models import adapter
from validation.scenes.load import load_scene

sys.path.append(str(Path(validation.__file__).parents[1] / "docs" / "plugin-example"))
import rigid_rod

scene = load_scene("soft")
print(rigid_rod.refusal(scene) or "the rod takes this scene")

figure, axis = plt.subplots(figsize=(6, 3.4), layout="constrained")
for model in (adapter("hcm"), rigid_rod):
    record = model.run(scene).record
    forces, start = record.contact_forces, record.value("contact_time_s")
    label = f"{model.name}: {record.value('peak_normal_force_N'):.1f} N at {1e3 * start:.1f} ms"
    axis.plot(1e3 * (forces["time_s"] - start), forces["normal_force_N"], label=label)
axis.set(xlim=(-0.02, 0.5), xlabel="$t - t_c$ (ms)", ylabel="normal force (N)")
axis.legend()
plt.show()

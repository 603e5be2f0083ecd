"""
The paper's table
=================

Peak contact forces of the hard and the soft finger: what the article's Table 2 prints for its
reduced model and its finite elements, and what ours give. The reduced model agrees with the
printed values to 0.2 %. The reference does not: the paper's coarse mesh and soft penalty are not
converged, and a tip that is meshed for its contact gives half as much again.
"""

from matplotlib import pyplot as plt

from validation.models import adapter
from validation.scenes.load import load_scene
from validation.validate.tables import printed

MODELS = {"hcm": "hcm", "reference": "fem3d"}  # name in the paper's claims: our model
KEY = "peak_normal_force_N"

figure, axes = plt.subplots(1, 2, figsize=(8, 3.4), layout="constrained")
for axis, name in zip(axes, ("hard", "soft"), strict=True):
    scene = load_scene(name)
    paper = [printed(name, KEY)[who].number for who in MODELS]
    ours, bars = [], []
    for model in MODELS.values():
        record = adapter(model).run(scene).record
        ours.append(record.value(KEY))
        bars.append(record.errors[KEY])
        print(f"{name}, {model}: {ours[-1]:.2f} +- {bars[-1]:.2g} N")
    axis.bar([-0.2, 0.8], paper, width=0.38, color="#888888", label="printed")
    axis.bar([0.2, 1.2], ours, width=0.38, yerr=bars, capsize=4, color="#0072b2", label="computed")
    axis.set_xticks([0, 1], ["reduced model", "finite elements"])
    axis.set_title(f"{name} finger", loc="left")
    axis.set_ylabel("peak normal force (N)")
axes[1].legend()
plt.show()

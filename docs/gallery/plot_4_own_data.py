"""
Curves of your own
==================

A measurement or another program's run is a CSV with a column of times and one of forces; what the
file doesn't say goes beside it in TOML. The example is a made-up load cell: milliseconds, noise
with its standard deviation, and a clock that started 135.9 ms late.
"""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot as plt

from validation.curve_files.read import read_reference
from validation.models import adapter
from validation.scenes.load import load_scene

scene = load_scene("soft")
time = np.linspace(0.0, 0.6, 301)  # ms
inside = np.clip((time - 0.2) / 0.24, 0.0, 1.0)
force = 66.0 * np.sin(np.pi * inside) + np.random.default_rng(1).normal(0.0, 0.5, time.size)
columns = {"time_ms": time, "normal_force_N": force, "normal_force_sigma_N": 0.5}

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "cell.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    beside = 'scene = "soft"\nthreshold_N = 2.0\ntime_offset_s = -0.1359\n'
    Path(f"{path}.toml").write_text(beside, encoding="utf-8")
    measured = read_reference(str(path), scene)

model = adapter("hcm").run(scene).record
print(*measured.notes, sep="\n")

figure, axis = plt.subplots(figsize=(6, 3.4), layout="constrained")
for record, style in ((measured.record, "."), (model, "-")):
    forces, peak = record.contact_forces, record.value("peak_normal_force_N")
    start = record.value("contact_time_s")
    label = f"{record.label}: {peak:.1f} ± {record.errors['peak_normal_force_N']:.1g} N"
    axis.plot(1e3 * (forces["time_s"] - start), forces["normal_force_N"], style, label=label)
axis.set(xlim=(-0.05, 0.3), xlabel="$t - t_c$ (ms)", ylabel="normal force (N)")
axis.legend()
plt.show()

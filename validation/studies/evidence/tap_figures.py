"""The taps' forces and their fields of stress, by CalculiX and by the reference.

One column of panels, so that a telephone shows them as large as they were drawn.
"""

from itertools import groupby
from pathlib import Path

import numpy as np

from validation.harness.figures import BLUE, GREEN, ORANGE, panels
from validation.harness.store import Store
from validation.studies.evidence.taps import TAPS, SpringTap, calculix_tap, reference_tap, title

WIDTH = 3.5  # inches
COLORS = {"C3D8": ORANGE, "C3D8I": GREEN}
FIELDS_OF = ("tap-soft", "tap-hard")
REACH_MM = 7.0  # of what is shown, from the lowest point
LIMIT = 99.0  # percentile of the stresses at which colours end


def draw_forces(path: Path, store: Store) -> None:
    """Draw the forces of all taps, a panel each, with both of CalculiX's elements."""
    groups = [list(taps) for _, taps in groupby(TAPS.values(), lambda tap: tap.ours)]
    with panels(path, 1, len(groups), width=WIDTH, height=2.3) as axes:
        for (axis,), taps in zip(axes, groups, strict=True):
            own = reference_tap(taps[0], store)
            axis.plot(1e6 * np.array(own.time_s), own.normal_force_N, color=BLUE, label="fem3d")
            for tap in taps:
                theirs = calculix_tap(tap, store)
                axis.plot(1e6 * np.array(theirs.time_s), theirs.normal_force_N, "--",
                          color=COLORS[tap.element], label=f"CalculiX {tap.element}")  # fmt: skip
            axis.set_title(title(taps[0]).removeprefix("The "), fontsize=8, loc="left")
            axis.set_ylabel("normal force (N)")
            axis.legend()
        axes[-1][0].set_xlabel("time (us)")


def draw_field(path: Path, tap: SpringTap, store: Store) -> None:
    """Draw von Mises' stress at the tip in the plane of symmetry: theirs, ours, the difference."""
    from matplotlib.collections import PolyCollection

    theirs, own = calculix_tap(tap, store), reference_tap(tap, store)
    corners, cut = np.array(own.corners_mm), np.array(own.cut)
    other, mine = (1e-3 * np.array(of.von_mises_kPa)[cut] for of in (theirs, own))
    lowest = corners.reshape(-1, 2)[corners[..., 1].argmin()]
    near = np.linalg.norm(corners.mean(axis=1) - lowest, axis=1) < REACH_MM
    top = float(np.percentile(np.concatenate([other[near], mine[near]]), LIMIT))
    apart = float(np.abs(mine - other)[near].max())
    shown = (
        (f"{theirs.program}, {tap.element}", other, "viridis", (0.0, top)),
        ("fem3d, the same mesh and time", mine, "viridis", (0.0, top)),
        ("fem3d less CalculiX", mine - other, "RdBu_r", (-apart, apart)),
    )
    with panels(path, 1, 3, width=WIDTH, height=1.8, style={"axes.grid": False}) as axes:
        for (axis,), (name, values, colors, limits) in zip(axes, shown, strict=True):
            drawn = PolyCollection(corners[near], array=values[near], cmap=colors,
                                   edgecolors="#00000040", linewidths=0.2)  # fmt: skip
            drawn.set_clim(*limits)
            axis.add_collection(drawn)
            axis.autoscale_view()
            axis.set_aspect("equal")
            axis.set_title(name, fontsize=8, loc="left")
            axis.figure.colorbar(drawn, ax=axis, label="von Mises (MPa)")
        axes[-1][0].set_xlabel("x, and upwards y (mm)")

"""Both models on one plot: what an error against a model's own truth costs, and how far apart the
truths are.

No amount of refinement brings a model nearer to the other than the gap between their truths: a
point below the gap is exact as far as the comparison goes.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.compare.tap_errors import TapErrors, TapQuantities, tap_errors
from validation.harness.figures import BLACK, BLUE, GREY, ORANGE, panels
from validation.studies.bench.figures import QUANTITIES, SMALLEST, crosses
from validation.studies.bench.measured import Point, front
from validation.studies.bench.truths import Known

if TYPE_CHECKING:
    import pandas as pd

TITLES = {
    "hcm": ("hcm", BLACK, "o"),
    "fem3d": ("3D reference", ORANGE, "s"),
    "fem2d": ("plane stress", BLUE, "^"),
}
NAMES = {
    "contact_time_s": "contact_time_s",
    "turn_s": "time_of_peak_after_contact_s",
    "duration_s": "duration_s",
    "peak_normal_force_N": "peak_normal_force_N",
    "normal_impulse_N_s": "normal_impulse_N_s",
}
ROOM = 6.0  # above the highest point, for the crosses of failed runs


def gap(known: Mapping[str, Known]) -> TapErrors:
    """The reduced model's truth against the solid one's."""
    return tap_errors(known["hcm"].values, known["fem3d"].values)


def truths_table(known: Mapping[str, Known]) -> "pd.DataFrame":
    """One row a quantity: every model's truth, and the gap between hcm's and the solid's."""
    import pandas as pd

    def value(of: TapQuantities, name: str) -> float:
        return float(getattr(of, name))

    rows: list[dict[str, Any]] = []
    for name, title in NAMES.items():
        row: dict[str, Any] = {"quantity": title}
        row |= {model: value(truth.values, name) for model, truth in known.items()}
        row["hcm_off_fem3d"] = row["hcm"] / row["fem3d"] - 1.0
        rows.append(row)
    own: dict[str, Any] = {"quantity": "the truth's own relative error"}
    return pd.DataFrame([*rows, own | {model: truth.own_error for model, truth in known.items()}])


def draw(path: Path, points: Sequence[Point], known: Mapping[str, Known]) -> None:
    """One panel a quantity.

    Parameters
    ----------
    points : `Point.solver` is the model.
    known : truths by model; ``hcm``, ``fem3d`` and ``fem2d``.
    """
    between = gap(known)
    with panels(path, 2, 2, width=5.0) as axes:
        for axis, (quantity, title) in zip(axes.flat, QUANTITIES, strict=True):
            for model, (name, color, marker) in TITLES.items():
                mine = [p for p in points if p.solver == model]
                good = [p for p in mine if p.ok]
                axis.plot(
                    [p.wall_time_s for p in good],
                    [max(getattr(p.errors, quantity), SMALLEST) for p in good],
                    marker, color=color, markersize=3.5, alpha=0.35, markeredgewidth=0,
                )  # fmt: skip
                best = front(mine, quantity)
                axis.plot([t for t, _ in best], [max(e, SMALLEST) for _, e in best], "-" + marker,
                          color=color, markersize=4, linewidth=1.2, label=name)  # fmt: skip
                crosses(axis, mine, color, 1.0)
                if quantity != "event_s":
                    axis.axhline(known[model].own_error, color=color, linewidth=0.7, linestyle=":")
            level = getattr(between, quantity)
            axis.axhline(level, color=GREY, linewidth=1.2, linestyle="--")
            text = f"{1e3 * level:.2g} ms" if quantity == "event_s" else f"{100 * level:.2g} %"
            axis.annotate(f"gap between the models' truths: {text}", (0.01, level),
                          xycoords=("axes fraction", "data"), ha="left", va="bottom",
                          fontsize=7, color="#555555")  # fmt: skip
            axis.set_xscale("log")
            axis.set_yscale("log")
            axis.set_ylim(top=ROOM * axis.get_ylim()[1])
            axis.set_title(title, fontsize=10, loc="left")
            axis.set_xlabel("time of a run (s)")
        axes[0][0].legend(fontsize=8)

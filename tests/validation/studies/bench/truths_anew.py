"""The truths of `validation.studies.bench.truths` recomputed, hcm's by `hcm.reference_solution`,
the reference's by its runs.

    python -m tests.validation.studies.bench.truths_anew fem3d

prints a line per run, then every quantity beside the stored one. On one thread hcm's take half a
minute (`contact`) and minutes (`tap`), 2D half a minute, 3D a quarter of an hour and 2 GB.
"""

from dataclasses import asdict
from typing import Literal

import cyclopts

from validation.compare.tap_errors import TapQuantities
from validation.harness.console import output
from validation.harness.interrupts import unless_interrupted
from validation.models.solid_inputs import DIMENSIONS, finger_geometry, solid_parts
from validation.scenes.load import load_scene
from validation.studies.bench import hcm_settings
from validation.studies.bench.reference_settings import impulse_mesh, solid_tap
from validation.studies.bench.truths import CONTACT_ELEMENTS, TAP_ELEMENTS, TRUTHS
from validation.studies.bench.work_precision import Setting, simulation

# Refinements (shaft, tip) of `impulse_mesh`: the finest run; and two whose difference, due to half
# the shaft's edges, is added to it in 3D, where the finest tip was too expensive on that shaft.
FINEST = {"fem3d": (2.0, 0.5), "fem2d": (0.5, 0.25)}
SHAFTS = {"fem3d": ((2.0, 1.0), (1.0, 1.0))}


def solve_tap(model: str, shaft: float, tip: float) -> TapQuantities:
    """Solve one tap from rest, with contact by impulses.

    Raises RuntimeError: the run did not complete.
    """
    name = f"shaft {shaft:g}, tip {tip:g}"
    setting = Setting(model, model, "", name, impulse_mesh(shaft, tip))
    result = unless_interrupted(simulation(model, setting.overrides())())
    found = solid_tap(result)
    if found is None:
        raise RuntimeError(f"{model}, {name}: {result.message or result.status.name}")
    return found


def contact_time(model: str) -> float:
    """Time of the true body's rigid flight, s."""
    import reference_fem

    tables = load_scene("soft").tables
    state = reference_fem.impact_state(
        finger_geometry(tables), *solid_parts(tables)[:3], 0.0, dim=DIMENSIONS[model]
    )
    if state is None:
        raise RuntimeError(f"{model}: the surface is not reached")
    return state.time_s


def solve_truth(model: str) -> TapQuantities:
    """Compute a truth; runs of the reference are printed as they end."""
    if model == "tap":
        return hcm_settings.solve_tap(TAP_ELEMENTS, 1e-9)
    if model == "contact":
        return hcm_settings.solve_impact(CONTACT_ELEMENTS, 1e-9)

    def shown(shaft: float, tip: float) -> dict[str, float]:
        found = asdict(solve_tap(model, shaft, tip))
        output(f"{model}, shaft {shaft:g}, tip {tip:g}: {found}")
        return found

    values = shown(*FINEST[model])
    if model in SHAFTS:
        coarse, fine = (shown(*which) for which in SHAFTS[model])
        values = {name: value + fine[name] - coarse[name] for name, value in values.items()}
    return TapQuantities(**{**values, "contact_time_s": contact_time(model)})


def main(truth: Literal["tap", "contact", "fem2d", "fem3d"], /) -> None:
    """Print a truth computed anew beside the stored one."""
    found, stored = asdict(solve_truth(truth)), asdict(TRUTHS[truth].values)
    for name, value in found.items():
        output(
            f"{name}: {value:.6g}, stored {stored[name]:.6g}, off {value / stored[name] - 1:.1e}"
        )


if __name__ == "__main__":
    cyclopts.run(main)

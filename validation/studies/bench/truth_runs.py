"""The reference's stored truths (`reference_truths`), made anew from the runs they are read from.

    python -m validation.studies.bench.truth_runs fem3d

prints a line a run, then every quantity beside the stored one. On one thread 2D takes half a
minute, 3D a quarter of an hour and 2 GB.
"""

import argparse
from dataclasses import asdict

from validation.compare.tap_errors import TapQuantities
from validation.converge.refinements import mesh_sizes
from validation.harness.interrupts import unless_interrupted
from validation.models.solid import build_mesh, inputs
from validation.studies.bench.reference_precision import DIMENSIONS, IMPULSE, Rung, quantities
from validation.studies.bench.reference_truths import KNOWN

# Refinements (shaft, tip) of `ladders`: the finest run; and two whose difference, shaft against
# half the shaft, is added to it in 3D, where the finest tip was too dear on the finer shaft.
FINEST = {"fem3d": (2.0, 0.5), "fem2d": (0.5, 0.25)}
SHAFTS = {"fem3d": ((2.0, 1.0), (1.0, 1.0))}
EVEN = {"fem3d": (7.5e-4, 3.75e-4), "fem2d": (2.5e-4, 1.25e-4)}  # m, the flight's meshes


def tap(model: str, shaft: float, tip: float) -> TapQuantities:
    """One tap from rest, contact by impulses.

    Raises
    ------
    RuntimeError
        The run did not complete.
    """
    import reference_fem

    setting = f"shaft {shaft:g}, tip {tip:g}"
    overrides = {**IMPULSE, **mesh_sizes(1.0, shaft, tip)}
    tables = Rung(model, "truth", setting, overrides).scene().tables
    mesh = build_mesh(tables, DIMENSIONS[model])
    result = unless_interrupted(reference_fem.simulate(mesh, *inputs(tables)))
    found = quantities(result)
    if found is None:
        raise RuntimeError(f"{model}, {setting}: {result.message or result.status.name}")
    return found


def contact_time(model: str) -> float:
    """Time of the rigid flight, s, of even meshes of h and h/2 extrapolated by h^2."""
    coarse, fine = (_flight(model, edge) for edge in EVEN[model])
    return fine + (fine - coarse) / 3.0


def _flight(model: str, edge: float) -> float:
    import reference_fem

    sizes = {f"solver.fem.{name}_size": edge for name in ("section", "axial", "tip")}
    tables = Rung(model, "flight", f"{edge:g} m", sizes).scene().tables
    materials, surface, drive, _ = inputs(tables)
    mesh = build_mesh(tables, DIMENSIONS[model])
    state = reference_fem.impact_state(mesh, materials, surface, drive, 0.0)
    if state is None:
        raise RuntimeError(f"{model}: the surface is not reached")
    return state.time_s


def truth(model: str) -> TapQuantities:
    """All runs of a model's truth, printed as they end."""

    def shown(shaft: float, tip: float) -> TapQuantities:
        found = tap(model, shaft, tip)
        print(f"{model}, shaft {shaft:g}, tip {tip:g}: {asdict(found)}", flush=True)
        return found

    values = asdict(shown(*FINEST[model]))
    if model in SHAFTS:
        coarse, fine = (asdict(shown(*which)) for which in SHAFTS[model])
        values = {name: value + fine[name] - coarse[name] for name, value in values.items()}
    return TapQuantities(**{**values, "contact_time_s": contact_time(model)})


def main() -> None:
    """Read the command line; print the truth and what is stored."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("model", choices=sorted(KNOWN))
    model = parser.parse_args().model
    found, stored = asdict(truth(model)), asdict(KNOWN[model].values)
    for name, value in found.items():
        print(f"{name}: {value:.6g}, stored {stored[name]:.6g}, off {value / stored[name] - 1:.1e}")


if __name__ == "__main__":
    main()

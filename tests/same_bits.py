"""Whether two checkouts compute the same: ``python -m tests.same_bits OLD [NEW] [CASE ...]``.

Some forty runs over all models, contact laws, elements, flights and integrators, made in each
checkout by its public Python interface. Every number of a result, histories and fields included, is
compared bit for bit; wall times are not. Exit code 1 where any differs.
"""

import dataclasses
import enum
import hashlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
UNLIKE = ("wall_time_s",)  # members that no two runs share

Case = Callable[[], Any]


def reduced(
    *,
    modulus: float = 1e9,
    density: float = 1400.0,
    diameter: float = 0.015,
    elements: int = 10,
    phalanges: int = 3,
    height: float = 0.1,
    friction: float = 0.5,
    tip: Mapping[str, float] | None = None,
    torques: Sequence[float] = (),
    reaction: bool = False,
    start: bool = False,
    refined: bool = False,
    **settings: Any,
) -> Case:
    """A run of the reduced model, by default of the paper's soft finger."""

    def run() -> Any:
        import hcm

        assumptions = hcm.Assumptions("refined" if refined else "paper")
        ratio = {"poisson_ratio": 0.4} if refined else {}
        phalanx = hcm.Phalanx(0.04, diameter, modulus, density, elements, **ratio)
        return hcm.simulate(
            hcm.Finger((phalanx,) * phalanges),
            hcm.Surface(height, friction),
            hcm.Tip(**{"normal_stiffness": 0.78e6, **(tip or {})}),
            hcm.Drive(tuple(torques), reaction=reaction),
            hcm.Settings(**settings),
            start=hcm.RigidStart((0.2, 0.5, 0.66), (3.0, 9.0, 14.0), 0.1) if start else None,
            assumptions=assumptions,
        )

    return run


def _mesh(dimension: int, mirrored: bool, shaft_radius: float | None, tip_size: float) -> Any:
    import meshes

    holes = {} if shaft_radius is None else {"shaft_radius": shaft_radius}
    geometry = meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3, **holes)
    build = meshes.finger_hexahedra if dimension == 3 else meshes.finger_quadrilaterals
    mesh = build(geometry, meshes.Sizing(3e-3, 5e-3, tip_size))
    return meshes.mirrored(mesh) if mirrored else mesh


def solid(
    dimension: int = 3,
    *,
    mirrored: bool = False,
    shaft_radius: float | None = None,
    tip_size: float = 1e-3,
    modulus: float = 1e9,
    density: float = 1400.0,
    friction: float = 0.5,
    height: float = 0.1,
    torques: Sequence[float] = (),
    lumped: Mapping[str, float] | None = None,
    material: Mapping[str, str] | None = None,
    **settings: Any,
) -> Case:
    """A run of the reference, by default of the paper's soft finger on a coarse mesh."""

    def run() -> Any:
        import reference_fem as fem

        mesh = _mesh(dimension, mirrored, shaft_radius, tip_size)
        scene = (
            mesh,
            (fem.Material(modulus, 0.4, density, **(material or {})),) * 3,
            fem.Surface(height, friction),
            fem.Drive(tuple(torques)),
        )
        law = {} if lumped is None else {"contact": fem.LumpedContact(**lumped)}
        return fem.simulate(*scene, fem.Settings(**{"threads": 2, **settings, **law}))

    return run


HARD = {"modulus": 20e9, "density": 1048.7}
LUMPED = {"normal_stiffness": 0.78e6}
CASES: dict[str, Case] = {
    "hcm soft": reduced(elements=20),
    "hcm hard": reduced(**HARD, tip={"normal_stiffness": 5.15e6}),
    "hcm smooth": reduced(friction=0.0),
    "hcm sticking": reduced(friction=1.3, tip={"restitution": 0.8}),
    "hcm restitution": reduced(tip={"restitution": 0.6, "tangential_ratio": 0.5}),
    "hcm compliant": reduced(modulus=1e7),
    "hcm slender": reduced(diameter=0.005),
    "hcm one phalanx": reduced(phalanges=1, height=0.02, elements=4),
    "hcm several taps": reduced(taps=3),
    "hcm end time": reduced(end_time=0.15, frame_times=(0.05, 0.1364, 0.14)),
    "hcm fixed steps": reduced(flight_tolerance=0.0, contact_tolerance=0.0, spectral_radius=1.0),
    "hcm new factors": reduced(reuse_factors=False),
    "hcm paper start": reduced(consistent_start=False),
    "hcm driven": reduced(torques=(0.02, 0.01, 0.002), reaction=True),
    "hcm whirling": reduced(modulus=1e8, torques=(0.5, 0.4, 0.1), spectral_radius=1.0),
    "hcm rigid flight": reduced(flight="rigid"),
    "hcm gauss": reduced(flight_integrator="gauss", elements=5),
    "hcm gauss rebounds": reduced(flight_integrator="gauss", elements=5, taps=2),
    "hcm start": reduced(start=True),
    "hcm refined": reduced(refined=True),
    "hcm refined restitution": reduced(
        refined=True, friction=1.1, modulus=1e8, tip={"restitution": 0.6}, flight="rigid"
    ),
    "hcm not reached": reduced(max_flight_time=0.05),
    "fem3d penalty": solid(),
    "fem3d hard": solid(**HARD),
    "fem3d smooth": solid(friction=0.0),
    "fem3d sticking": solid(friction=1.5, contact="surface"),
    "fem3d surface": solid(contact="surface"),
    "fem3d undamped surface": solid(contact="surface", contact_damping=0.0),
    "fem3d impulse": solid(contact="impulse"),
    "fem3d one point": solid(element="hex8-one-point"),
    "fem3d neo-Hookean": solid(material={"law": "neo-hooke"}),
    "fem3d one point impulse": solid(element="hex8-one-point", contact="impulse"),
    "fem3d whole body": solid(mirrored=True),
    "fem3d shaft holes": solid(shaft_radius=2.5e-3),
    "fem3d one thread": solid(threads=1),
    "fem3d several taps": solid(end_time_s=0.1375, tip_size=3e-3),
    "fem3d driven": solid(torques=(0.01, 0.005, 0.001)),
    "fem3d explicit flight": solid(tip_size=3e-3, height=0.008, flight="explicit"),
    "fem2d penalty": solid(2),
    "fem2d surface": solid(2, contact="surface"),
    "fem2d impulse": solid(2, contact="impulse"),
    "fem2d explicit flight": solid(2, tip_size=3e-3, height=0.008, flight="explicit"),
    "fem3d lumped": solid(lumped=LUMPED),
    "fem3d lumped restitution": solid(lumped={**LUMPED, "restitution": 0.8}),
    "fem3d lumped Hertz": solid(lumped={**LUMPED, "hertz_force": 60.0}),
    "fem3d lumped smooth": solid(friction=0.0, lumped=LUMPED),
    "fem2d lumped": solid(2, lumped=LUMPED),
}


def numbers(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Every number of a result by its place: exact text, or the digest of an array."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind in "bi":  # the same whole numbers in another type are the same
            value = value.astype(np.float64)
        data = np.ascontiguousarray(value).tobytes()
        yield name, f"{value.dtype.str}{value.shape} {hashlib.sha256(data).hexdigest()[:16]}"
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in UNLIKE:
                yield from numbers(getattr(value, field.name), f"{name}.{field.name}")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from numbers(item, f"{name}.{key}")
    elif isinstance(value, enum.Enum):
        yield name, value.name
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for i, item in enumerate(value):
            yield from numbers(item, f"{name}[{i}]")
    elif isinstance(value, float):
        yield name, float(value).hex() if math.isfinite(value) else repr(value)
    else:
        yield name, repr(value)


def _computed(checkout: Path, names: Sequence[str]) -> dict[str, dict[str, str]]:
    """What a checkout computes, in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "NUMBA_NUM_THREADS": "2"}
    ran = subprocess.run(
        [sys.executable, "-P", __file__, "--compute", *names],
        env=environment,
        cwd=checkout,
        stdout=subprocess.PIPE,
        check=True,
    )
    found: dict[str, dict[str, str]] = json.loads(ran.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Compare two checkouts, or (``--compute``) print what this one computes."""
    arguments = sys.argv[1:]
    if arguments[0] == "--compute":
        print(json.dumps({name: dict(numbers(CASES[name]())) for name in arguments[1:]}))
        return
    folders = [Path(a).resolve() for a in arguments if a not in CASES]
    names = [a for a in arguments if a in CASES] or list(CASES)
    old, new = (_computed(folder, names) for folder in ([*folders, ROOT])[:2])
    unlike = 0
    for name in names:
        differ = [
            f"    {key}: {old[name].get(key)} -> {new[name].get(key)}"
            for key in sorted({*old[name], *new[name]})
            if old[name].get(key) != new[name].get(key)
        ]
        print(f"{name}: {'equal' if not differ else 'DIFFERS'} ({len(old[name])} numbers)")
        print("\n".join(differ[:12]), end="\n" if differ else "")
        unlike += bool(differ)
    print(f"{len(names)} runs, {unlike} differ")
    sys.exit(1 if unlike else 0)


if __name__ == "__main__":
    main()

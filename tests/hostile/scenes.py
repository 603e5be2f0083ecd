"""Scenes for tries: plausible fingers, hostile values, and a scene in other units."""

import copy
import datetime
import random
from typing import Any

from validation.scenes.messages import known_keys

Document = dict[str, Any]

COARSE = {"section_size": 5e-3, "axial_size": 1e-2, "tip_size": 5e-3}  # of a finger 15 mm thick
SHORT = ("solver.hcm.max_steps=30000", "solver.fem.max_steps=30000")
VALUES: tuple[Any, ...] = (
    0, 0.0, -0.0, -1, -1.5, 1, 2, 3, 1.5, 7, 1000, 10**9, 2**63, 10**400, 1e-300, 5e-324, 1e300,
    float("nan"), float("inf"), -float("inf"), True, False, "", " ", "1", "1e9", "nan", "1 GPa",
    "soft", "\x1b[31mred", "a\0b", "\u202e\u0661\ud7ff", "🖐", "x" * 5000, "{0}%s", "../../etc",
    [], [[]], [1], [1.0, 2.0, 3.0], [1, "x", 3], [0.0] * 3, [float("nan")] * 3, [0.04] * 200, {},
    {"a": {"b": 1}}, datetime.date(2026, 11, 22), datetime.time(1, 2, 3),
)  # fmt: skip
UNKNOWN = (
    "finger.lenght", "Finger.length", "surface.height_m", "solver", "solver.hcm", "solver.xyz.a",
    "material.youngs_modulus.value", "a", "\x1b[2J", "é.ß", "a b.c", "tip", "drive.torque",
    "finger." + "x" * 3000, ".".join("abcdefgh"),
)  # fmt: skip
SLIPS = (1e-12, 1e-6, 1e-3, 0.1, 0.3, 0.5, 0.7, 0.9, 1.1, 1.5, 2, 3, 10, 1e3, 1e6, 1e12, -1)


def finger(dice: random.Random) -> Document:
    """A plausible finger: it falls or is driven down from the stretched position."""

    def log(low: float, high: float) -> float:
        return float(f"{low * (high / low) ** dice.random():.4g}")

    count, length, slenderness = dice.randint(1, 4), log(0.01, 0.1), log(3, 12)
    modulus, density, diameter = log(2e7, 5e10), log(500, 8000), length / slenderness
    weight = density * diameter**2 * length**2 * 9.8
    torques = [round(weight * count * dice.uniform(-0.2, 1), 12) for _ in range(count)]
    return {
        "finger": {"phalanges": count, "length": length, "diameter": diameter,
                   "elements": dice.randint(3, 12)},
        "material": {"youngs_modulus": modulus, "density": density,
                     "poisson_ratio": round(dice.uniform(0, 0.49), 3)},
        "surface": {"height": count * length * dice.uniform(0.5, 0.95),
                    "friction": dice.choice([0.0, log(0.05, 1.5)])},
        "tip": {"normal_stiffness": modulus * diameter * log(0.02, 0.2),
                "restitution": dice.choice([1.0, round(dice.uniform(0.3, 1), 3)])},
        "drive": {"gravity": 9.8} | ({"torques": torques} if dice.random() < 0.5 else {}),
        "solver": {"fem": {key: size * diameter / 0.015 for key, size in COARSE.items()}},
    }  # fmt: skip


def put(document: Document, key: str, value: Any) -> bool:
    """Set a dotted key; whether there is room for it."""
    *path, last = key.split(".")
    for part in path:
        document = document.setdefault(part, {})
        if not isinstance(document, dict):
            return False
    document[last] = value
    return True


def get(document: Document, key: str) -> Any:
    """What stands at a dotted key, None if nothing does."""
    found: Any = document
    for part in key.split("."):
        found = found.get(part) if isinstance(found, dict) else None
    return found


def hostile(dice: random.Random, document: Document) -> tuple[str, Any]:
    """A key and a value that it should not have: a slip of units, another type, an extreme."""
    if dice.random() < 0.05:
        return dice.choice(UNKNOWN), dice.choice(VALUES)
    known = list(known_keys())
    slips = [key for key in known if isinstance(get(document, key), float)]
    if dice.random() < 0.75:
        key = dice.choice(slips)
        return key, get(document, key) * dice.choice(SLIPS)
    return dice.choice(known), dice.choice(VALUES)


# Exponents of length, time and mass in what a scene gives; all else is a pure number.
DIMENSIONS = {
    "finger.length": (1, 0, 0), "finger.diameter": (1, 0, 0), "surface.height": (1, 0, 0),
    "material.youngs_modulus": (-1, -2, 1), "material.density": (-3, 0, 1),
    "tip.normal_stiffness": (0, -2, 1), "drive.torques": (2, -2, 1), "drive.gravity": (1, -2, 0),
    **{f"solver.fem.{name}": (1, 0, 0) for name in COARSE},
}  # fmt: skip
STEPS = {  # hcm's defaults, and both models' limits of time
    "solver.hcm.flight_step": (1e-4, (0, 1, 0)), "solver.hcm.contact_step": (1e-6, (0, 1, 0)),
    "solver.hcm.contact_tolerance": (1e-11, (1, 0, 0)),
    "solver.hcm.max_flight_time": (2.0, (0, 1, 0)), "solver.fem.max_flight_time": (2.0, (0, 1, 0)),
    "solver.hcm.max_contact_time": (0.05, (0, 1, 0)),
    "solver.fem.max_contact_time": (0.05, (0, 1, 0)),
}  # fmt: skip
RESULTS = {
    "contact_time_s": (0, 1, 0), "tip_velocity_at_contact_m_per_s": (1, -1, 0),
    "peak_normal_force_N": (1, -2, 1), "peak_tangential_force_N": (1, -2, 1),
    "contact_duration_s": (0, 1, 0), "normal_impulse_N_s": (1, -1, 1),
    "peak_stress_R_Pa": (-1, -2, 1),
}  # fmt: skip

Three = tuple[float, float, float]


def times(value: Any, units: Three, powers: tuple[int, int, int]) -> Any:
    """A quantity in other units."""
    if isinstance(value, list):
        return [times(item, units, powers) for item in value]
    for unit, power in zip(units, powers, strict=True):
        value = value * unit**power
    return value


def in_units(document: Document, units: Three, steps: bool) -> Document:
    """The same scene with its metre, second and kilogram multiplied; with its steps too."""
    scaled = copy.deepcopy(document)
    given = {key: (get(document, key), powers) for key, powers in DIMENSIONS.items()}
    for key, (value, powers) in (given | (STEPS if steps else {})).items():
        if value is not None:
            put(scaled, key, times(value, units, powers))
    return scaled

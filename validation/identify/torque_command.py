"""``fingertap identify torque``: the unit of the paper's printed t_3, from its arrival times."""

import json
import os
from typing import Any

from validation.paper.identify_torque import TorqueFactor, identify, predict
from validation.workers import workers


def run_identify_torque(as_json: bool) -> None:
    """Identify, predict and print."""
    with workers(max(1, min(3, os.cpu_count() or 1))) as pool:
        found = identify(pool)
        predicted = predict(found, pool)
    if as_json:
        print(json.dumps({**to_json(found), "predictions": predicted}, indent=2))
        return
    print(f"factor on the printed t_3: {found.factor:.4g} +- {found.uncertainty:.2g} N m a unit")
    for scene, time in found.computed.items():
        printed = found.printed[scene]
        print(
            f"  {scene}: first contact at {1e3 * time:.3f} ms, printed {1e3 * printed:.3f} ms"
            f" ({100 * (time / printed - 1):+.2f} %)"
        )
    print("not fitted, with the factor at its lower bound, best value and upper bound:")
    for scene, by_label in predicted.items():
        for key in by_label["best"]:
            values = ", ".join(_text(by_label[label][key]) for label in ("low", "best", "high"))
            print(f"  {scene}: {key} {values}")


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value).lower()


def to_json(found: TorqueFactor) -> dict[str, object]:
    """The object that ``--json`` prints."""
    return {
        "factor_N_m_per_unit": found.factor,
        "uncertainty_N_m_per_unit": found.uncertainty,
        "arrival_times_s": {
            scene: {"printed": found.printed[scene], "computed": time}
            for scene, time in found.computed.items()
        },
    }

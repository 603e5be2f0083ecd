"""``fingertap identify torque``: the unit of the paper's printed t_3, from its arrival times."""

import json
from dataclasses import asdict
from typing import Any

from validation.harness.command_line import AsJson
from validation.harness.console import output
from validation.harness.processes import workers
from validation.harness.provenance import cores
from validation.harness.uncertainty import two_digits
from validation.studies.paper.case_runs import solve_case
from validation.studies.paper.driven_cases import PRINTED_TORQUES, driven
from validation.studies.paper.torque_factor import (
    CaseFactor,
    IdentifiedTorque,
    TorqueFactor,
    identify_torque,
)

PREDICTED = (
    *("first_peak_normal_force_N", "peak_stress_R_Pa"),
    *("compression_to_restitution", "stick_to_slip", "slip_to_stick", "reverse_slip"),
)
Predictions = dict[str, dict[str, dict[str, Any]]]  # by scene, bound of the factor, and quantity


def identify_and_predict() -> tuple[IdentifiedTorque, Predictions]:
    """The factors, and the common one's predictions of quantities that it was not fitted to."""
    with workers(min(3, cores())) as pool:
        found = identify_torque(pool)
        best, uncertainty = found.common.factor, found.common.uncertainty
        bounds = {"low": best - uncertainty, "best": best, "high": best + uncertainty}
        jobs = {
            scene: {
                label: pool.submit(solve_case, driven(scene, factor, label))
                for label, factor in bounds.items()
            }
            for scene in PRINTED_TORQUES
        }
        return found, {
            scene: {
                label: {key: job.result().record.summary[key] for key in PREDICTED}
                for label, job in by_label.items()
            }
            for scene, by_label in jobs.items()
        }


def run_identify_torque(*, as_json: AsJson = False) -> None:
    """Identify, predict and print."""
    identified, predicted = identify_and_predict()
    found = identified.common
    if as_json:
        more = {
            "alone": {scene: asdict(one) for scene, one in identified.by_case.items()},
            "numerics": {name: to_json(fit) for name, fit in identified.by_numerics.items()},
        }
        output(json.dumps({**to_json(found), **more, "predictions": predicted}, indent=2))
        return
    output(f"factor on the printed t_3: {found.factor:.4g} +- {found.uncertainty:.2g} N m a unit")
    for scene, time in found.computed.items():
        printed = found.printed[scene]
        output(
            f"  {scene}: first contact at {1e3 * time:.3f} ms, printed {1e3 * printed:.3f} ms"
            f" ({100 * (time / printed - 1):+.2f} %)"
        )
    output(f"  misfit {two_digits(found.misfit_percent)} % (root mean square)")
    for scene, one in identified.by_case.items():
        output(f"  {scene} alone: {_case_text(one)}")
    for name, fit in identified.by_numerics.items():
        output(f"  with {name}: factor {fit.factor:.4g}, misfit {two_digits(fit.misfit_percent)} %")
    output("not fitted, with the factor at its lower bound, best value and upper bound:")
    for scene, by_label in predicted.items():
        for key in by_label["best"]:
            values = ", ".join(_text(by_label[label][key]) for label in ("low", "best", "high"))
            output(f"  {scene}: {key} {values}")


def _case_text(one: CaseFactor) -> str:
    if one.factor is None or one.half_width is None:
        return (
            f"no factor brings it there; nearest {1e3 * one.best_time_s:.3f} ms"
            f" with {one.best_factor:.3g}"
        )
    return f"{one.factor:.4g} +- {one.half_width:.1g} (the rounding of its printed time)"


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value).lower()


def to_json(found: TorqueFactor) -> dict[str, object]:
    """The object that ``--json`` prints."""
    return {
        "factor_N_m_per_unit": found.factor,
        "uncertainty_N_m_per_unit": found.uncertainty,
        "misfit_percent": found.misfit_percent,
        "arrival_times_s": {
            scene: {"printed": found.printed[scene], "computed": time}
            for scene, time in found.computed.items()
        },
    }

"""``fingertap identify torque``: the unit of the printed t_3, from its three arrival times.

The paper drives the third hinge with 30, 3000 and 5500 "N m", which would fold the finger. With
torque t_3 = factor x printed value, the arrival times T_i(factor) of the three cases are three
measurements of one unknown: least squares on the relative residuals

    r_i = T_i(factor)/T_i,printed - 1,

with the standard uncertainty s/|J|, s^2 = sum r^2/(3 - 1), J = dr/dfactor (linear regression).
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from validation.compare.claims import read_claims
from validation.errors import RunFailedError
from validation.harness.command_line import AsJson
from validation.harness.console import output
from validation.harness.files import json_text
from validation.harness.processes import Workers, workers
from validation.harness.provenance import cores
from validation.harness.store import NO_STORE, Store
from validation.harness.uncertainty import two_digits, with_error
from validation.studies.paper.case_runs import Case, CaseRun, load_case, solve_case, solve_cases
from validation.studies.paper.cases import NUMERICS, PRINTED_TORQUES, driven
from validation.studies.paper.ledger import printed_rounding

ARRIVAL_CLAIMS = {"driven-1": "F13.1", "driven-2": "F13.2", "driven-3": "F13.3"}
# In 1e-5 N m per printed unit, so that searches deal with numbers of order 1.
BOUNDS = (5.0, 10.0)
CASE_BOUNDS = (5.0, 8.0)  # beyond, case 3's tip swings past the surface first
# Only the flight matters, and five elements per phalanx give its duration to 2e-4; the run ends as
# soon as the tip has touched.
FLIGHT_ONLY = ("finger.elements=5", "solver.hcm.max_contact_time=1e-9")
# Steps three times those of cases 2 and 3: their arrival moves by 1e-5.
COARSER = ("solver.hcm.flight_step=1e-6",)
PREDICTED = (  # quantities that the factor was not fitted to
    *("first_peak_normal_force_N", "peak_stress_R_Pa"),
    *("compression_to_restitution", "stick_to_slip", "slip_to_stick", "reverse_slip"),
)
Predictions = dict[str, dict[str, dict[str, Any]]]  # by scene, bound of the factor, and quantity


@dataclass(frozen=True)
class TorqueFactor:
    """The factor, its standard uncertainty, and the arrival times printed and computed, s."""

    factor: float
    uncertainty: float
    printed: Mapping[str, float]
    computed: Mapping[str, float]

    @property
    def misfit_percent(self) -> float:
        """Root mean square of the relative residuals."""
        relative = [self.computed[s] / self.printed[s] - 1 for s in self.printed]
        return 100 * float(np.sqrt(np.mean(np.square(relative))))


@dataclass(frozen=True)
class CaseFactor:
    """The factor from one case's arrival alone.

    factor, half_width : the factor with which the case arrives at its printed time, and its change
        by the printed time's rounding; None if no factor does.
    best_factor, best_time_s : the factor with the nearest arrival, and the time of that arrival.
    """

    factor: float | None
    half_width: float | None
    best_factor: float
    best_time_s: float

    @property
    def text(self) -> str:
        """The factor as text, or how near the printed time any factor brings the case."""
        if self.factor is None or self.half_width is None:
            return (
                f"no factor brings it there; nearest {1e3 * self.best_time_s:.3f} ms"
                f" with {self.best_factor:.3g}"
            )
        return f"{self.factor:.4g} +- {self.half_width:.1g} (the rounding of its printed time)"


@dataclass(frozen=True)
class IdentifiedTorque:
    """The common factor, each case's own, and the common ones under other numerics by name."""

    common: TorqueFactor
    by_case: Mapping[str, CaseFactor]
    by_numerics: Mapping[str, TorqueFactor]


def flight(scene: str, factor: float, numerics: tuple[str, ...] = ()) -> Case:
    """A driven case up to its first contact, with the scene's numerics or others."""
    steps = numerics or (() if scene == "driven-1" else COARSER)
    return driven(scene, factor, "flight", (*FLIGHT_ONLY, *steps))


def arrival_time(run: CaseRun) -> float:
    """Time of first contact of a driven case, s.

    Raises RunFailedError: the tip does not reach the surface with this factor.
    """
    time = run.record.value("contact_time_s")
    if time is None:
        raise RunFailedError(
            f"{run.case.scene}: the tip does not arrive with {run.case.overrides[0]}"
        )
    return time


def printed_arrivals() -> dict[str, float]:
    """The arrival times that the paper prints, s."""
    claims = read_claims()
    return {scene: claims[id_].number for scene, id_ in ARRIVAL_CLAIMS.items()}


def common_factor(
    pool: Workers, numerics: tuple[str, ...] = (), store: Store = NO_STORE
) -> TorqueFactor:
    """Least squares on the three arrival times, with the scenes' numerics or others.

    Flights that are stored are not run again.
    """
    from scipy.optimize import least_squares

    printed = printed_arrivals()
    target = np.array(list(printed.values()))

    def residuals(scaled: np.ndarray) -> np.ndarray:
        factor = 1e-5 * float(scaled[0])
        runs = solve_cases([flight(scene, factor, numerics) for scene in printed], pool, store)
        return np.array([arrival_time(run) for run in runs.values()]) / target - 1

    # arrival times jitter by about 1e-5 with the flight's steps: differences must be larger
    fit = least_squares(residuals, [7.0], bounds=BOUNDS, diff_step=0.02, xtol=1e-4)
    variance = float(np.sum(fit.fun**2)) / (fit.fun.size - 1)
    uncertainty = 1e-5 * float(np.sqrt(variance / np.sum(fit.jac**2)))
    computed = dict(zip(printed, ((fit.fun + 1) * target).tolist(), strict=True))
    return TorqueFactor(1e-5 * float(fit.x[0]), uncertainty, printed, computed)


def arrival_with(scene: str, factor: float, store: Store = NO_STORE) -> float:
    """Arrival time of one case, s, read back where it is stored."""
    case = flight(scene, factor)
    return arrival_time(load_case(store, case) or solve_case(case, store))


def case_factor(scene: str, store: Store = NO_STORE) -> CaseFactor:
    """The factor from one case's printed arrival time alone."""
    from scipy.optimize import brentq, minimize_scalar

    claim = read_claims()[ARRIVAL_CLAIMS[scene]]
    printed, rounding = claim.number, printed_rounding(claim.paper_value)

    def late(scaled: float) -> float:
        return arrival_with(scene, 1e-5 * float(scaled), store) - printed

    low, high = map(late, CASE_BOUNDS)
    if low * high > 0:
        nearest = minimize_scalar(
            lambda scaled: abs(late(scaled)),
            bounds=CASE_BOUNDS,
            method="bounded",
            options={"xatol": 0.02},
        )
        best = 1e-5 * float(nearest.x)
        return CaseFactor(None, None, best, arrival_with(scene, best, store))
    root = float(brentq(late, *CASE_BOUNDS, xtol=1e-3))
    slope = (late(root + 0.1) - late(root - 0.1)) / 0.2
    return CaseFactor(1e-5 * root, 1e-5 * rounding / abs(slope), 1e-5 * root, printed)


def identify_torque(pool: Workers, store: Store = NO_STORE) -> IdentifiedTorque:
    """All factors; flights that are not stored are run on the pool's processes."""
    single = {scene: pool.submit(case_factor, scene, store) for scene in PRINTED_TORQUES}
    return IdentifiedTorque(
        common_factor(pool, (), store),
        {scene: job.result() for scene, job in single.items()},
        {name: common_factor(pool, numerics, store) for name, numerics in NUMERICS.items()},
    )


def identify_and_predict() -> tuple[IdentifiedTorque, Predictions]:
    """The factors, and the common one's predictions of quantities that it was not fitted to."""
    with workers(min(3, cores())) as pool:
        found = identify_torque(pool)
        best, uncertainty = found.common.factor, found.common.uncertainty
        bounds = {"low": best - uncertainty, "best": best, "high": best + uncertainty}
        cases = [
            driven(scene, factor, label)
            for scene in PRINTED_TORQUES
            for label, factor in bounds.items()
        ]
        runs = solve_cases(cases, pool)
    return found, {
        scene: {
            label: {key: runs[f"{scene} {label}"].record.summary[key] for key in PREDICTED}
            for label in bounds
        }
        for scene in PRINTED_TORQUES
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
        output(json_text({**to_json(found), **more, "predictions": predicted}))
        return
    output(f"factor on the printed t_3: {with_error(found.factor, found.uncertainty)} N m a unit")
    for scene, time in found.computed.items():
        printed = found.printed[scene]
        output(
            f"  {scene}: first contact at {1e3 * time:.3f} ms, printed {1e3 * printed:.3f} ms"
            f" ({100 * (time / printed - 1):+.2f} %)"
        )
    output(f"  misfit {two_digits(found.misfit_percent)} % (root mean square)")
    for scene, one in identified.by_case.items():
        output(f"  {scene} alone: {one.text}")
    for name, fit in identified.by_numerics.items():
        output(f"  with {name}: factor {fit.factor:.4g}, misfit {two_digits(fit.misfit_percent)} %")
    output("not fitted, with the factor at its lower bound, best value and upper bound:")
    for scene, by_label in predicted.items():
        for key in by_label["best"]:
            values = ", ".join(_text(by_label[label][key]) for label in ("low", "best", "high"))
            output(f"  {scene}: {key} {values}")


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

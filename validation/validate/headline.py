"""The page's first screen: how far apart the models are, and how sure that is."""

from validation.compare.differences import Difference, differences_of, thousands_apart, turned
from validation.harness.page import above_or_below, opening, signed
from validation.harness.quantities import COMPARED, OF_A_TAP, Quantity, quantity
from validation.harness.uncertainty import two_digits
from validation.models.variants import cumulative, leave_one_out, short_name
from validation.validate.plan import DEFAULT_REFERENCE, PAPER_REDUCED, PLANE, REFINED, RunName, Runs

TANGENTIAL = quantity("peak_tangential_force_N")
ROUND = {PAPER_REDUCED.model, REFINED, DEFAULT_REFERENCE.model}  # models of the finger itself
MATTERS = 1.0  # percent of peak, impulse or duration
MODEL_NAMES = {PAPER_REDUCED.model: "the reduced model", REFINED: "the refined reduced model"}


def differences(runs: Runs, wanted: tuple[Quantity, ...] = OF_A_TAP) -> list[Difference]:
    """The differences in these quantities, of every model on every scene."""
    rows = list[Difference]()
    for scene in runs.scenes:
        reference = runs.reference(scene)
        for model in runs.plan.models:
            reduced = runs.of_model(scene, model)
            rows += differences_of(scene, model, reduced, reference, wanted, runs.plan.tolerances)
    return rows


def cumulative_differences(runs: Runs, scene: str) -> list[list[Difference]]:
    """A scene's differences with the paper's assumptions, then with one refined after the other.

    Empty unless `Plan.leads_to_refined`.
    """
    reference = runs.reference(scene)
    if not runs.plan.leads_to_refined:
        return []
    return [
        differences_of(scene, name, runs.find(scene, RunName(PAPER_REDUCED.model, name)), reference)
        for name in (variant.name for variant in cumulative())
    ]


def labels(runs: Runs, scene: str) -> dict[str, str]:
    """Names and times of a scene's compared models and, under "", of their reference."""
    found = {model: runs.of_model(scene, model) for model in runs.plan.models}
    named = {}
    for model, run in (found | {"": runs.reference(scene)}).items():
        cost = ""
        if run is not None and (time := run.value("wall_time_s")) is not None:
            time = float(f"{time:.2g}")
            cost = f", {time:g} s" if time >= 1 else f", {1e3 * time:g} ms"
        named[model] = (model or (run.label if run else "")) + cost
    return named


def unit_notes(runs: Runs) -> list[str]:
    """Notes on numbers that seem to be in another unit, or along another axis, than they should."""
    notes = []
    for row in differences(runs, COMPARED):
        reference = runs.reference(row.scene)
        if reference is None or row.reduced is None or row.reference is None:
            continue
        what = (
            f"{row.scene}, {row.model}: {row.quantity.key} = {row.reduced:.4g} {row.quantity.unit}"
        )
        if power := thousands_apart(row.reduced, row.reference):
            notes.append(
                f"{what} is about {1000.0**power:g} times that of {reference.label}: are both in"
                " the unit their name states?"
            )
        measured = row.scene in runs.plan.data and row.quantity == TANGENTIAL
        if measured and turned(row.reduced, row.reference):
            notes.append(
                f"{what} and {reference.label} has {row.reference:.4g}: are both along +X? If not,"
                f" turn the sign of tangential in the TOML file beside {reference.label}"
            )
    return notes


def cautions(runs: Runs) -> list[str]:
    """The doubts that the compared runs and their references state, and whether bodies differ."""
    found = list[str]()
    for scene in runs.scenes:
        named = [run for run in (*runs.compared(scene), runs.reference(scene)) if run]
        found += [f"{scene}, {run.label}: {run.doubt}" for run in named if run.doubt]
        models = {run.model for run in named}
        if round_ones := sorted(models & ROUND) if PLANE.model in models else []:
            found.append(
                f"{scene}: {PLANE.model} is plane stress, another body than that of"
                f" {', '.join(round_ones)}: its tip is a half cylinder, which touches along a line,"
                " and part of each difference is the body's"
            )
    return found


def sentences(rows: list[Difference]) -> list[str]:
    """One sentence per scene and model on the peak force, and what is further apart than that."""
    result = []
    for row in rows:
        if row.quantity != OF_A_TAP[0]:
            continue
        finger, whose = f"{opening(row.scene)} finger", MODEL_NAMES.get(row.model, row.model)
        error, verdict = row.error_percent, row.verdict
        if error is None or verdict is None:
            without = row.model if row.reduced is None else f"the reference of {row.model}"
            result.append(f"{finger}: no comparison, {without} failed or touched nothing.")
            continue
        apart = above_or_below(error)
        if apart.startswith("0.0 "):
            apart = "within 0.05 % of"
        known = "one of their errors is not known: not judged"
        if verdict.uncertainty is not None:
            known = f"known to {two_digits(verdict.uncertainty)} %: {verdict.judgement}"
        text = f"{finger}: {whose}'s peak force lies {apart} the reference's ({known})."
        further = ", ".join(
            f"{of.quantity.title} {above_or_below(of.error_percent)}"
            for of in rows
            if (of.scene, of.model) == (row.scene, row.model)
            and of.error_percent is not None
            and abs(of.error_percent) > abs(error) + MATTERS
            and of.verdict is not None
            and of.verdict.judgement == "resolved"
        )
        result.append(text + f" Further apart, and resolved: {further}." * bool(further))
    return result


def assumption_effects(runs: Runs) -> list[str]:
    """A sentence per scene: the effect of each refined assumption on peak, impulse or duration."""
    result = []
    for scene in runs.scenes:
        whole = runs.of_model(scene, REFINED)
        if whole is None:
            continue
        tried = {run.variant for run in runs.records if run.scene == scene}
        moved, lost = dict[str, float](), list[str]()
        for variant in leave_one_out():
            if variant.name not in tried:
                continue
            run = runs.find(scene, RunName(PAPER_REDUCED.model, variant.name))
            rows = differences_of(scene, REFINED, run, whole)
            shares = [row.error_percent for row in rows if row.error_percent is not None]
            name = short_name(variant.name.removeprefix("without ")).replace("_", " ")
            if shares:
                moved[name] = max(shares, key=abs)
            else:
                lost.append(name)
        finger = f"{opening(scene)} finger: the refined model without"
        if lost:
            result.append(f"{finger} {', '.join(lost)} failed or touched nothing.")
        if not moved:
            continue
        ranked = sorted(moved, key=lambda name: -abs(moved[name]))
        large = [
            f"{name} {signed(moved[name], 0)}" for name in ranked if abs(moved[name]) > MATTERS
        ]
        small = [name for name in ranked if abs(moved[name]) <= MATTERS]
        most = ", ".join(large) or "less than a percent"
        text = f"{finger} one of its assumptions moves by {most} (peak, impulse or duration,"
        text += " the largest)"
        text += f"; within {MATTERS:g} %: {', '.join(small)}." if small and large else "."
        result.append(text)
    return result

"""The page's first screen: how far apart the models are, and how sure that is."""

from validation.compare.differences import Difference, difference
from validation.compare.verdict import unit_slip
from validation.harness.quantities import COMPARED, OF_A_TAP, Quantity
from validation.validate.plan import REDUCED, Runs


def differences(runs: Runs, wanted: tuple[Quantity, ...] = OF_A_TAP) -> list[Difference]:
    """Those quantities of every model on every scene."""
    rows = []
    for scene in runs.scenes:
        reference = runs.reference(scene)
        for model in runs.plan.models:
            reduced = runs.of_model(scene, model)
            for entry in wanted:
                asked = runs.plan.tolerances.get(entry.key)
                rows.append(difference(scene, model, entry, reduced, reference, asked))
    return rows


def unit_notes(runs: Runs) -> list[str]:
    """Numbers that seem to be in another unit than their name says."""
    return [
        f"{row.scene}, {row.model}: {row.quantity.key} = {row.reduced:.4g} {row.quantity.unit} is "
        f"some {1000.0**power:g} times the reference's: is it in the unit of its name?"
        for row in differences(runs, COMPARED)
        if row.reduced is not None
        and row.reference is not None
        and (power := unit_slip(row.reduced, row.reference))
    ]


def sentences(rows: list[Difference]) -> list[str]:
    """One sentence per scene and model on the peak force, in words that the numbers bear out."""
    result = []
    for row in rows:
        if row.quantity != OF_A_TAP[0]:
            continue
        whose = "the reduced model" if row.model == REDUCED[0] else row.model
        if row.error_percent is None or row.verdict is None:
            missing = "no comparison, a run is missing"
            result.append(f"{row.scene.capitalize()} finger: {missing} ({row.model}).")
            continue
        side = "above" if row.error_percent > 0 else "below"
        text = (
            f"{row.scene.capitalize()} finger: {whose}'s peak force lies "
            f"{abs(row.error_percent):.1f} % {side} the reference's"
        )
        u = row.verdict.uncertainty
        if u is not None:
            text += f" (known to {u:.2g} %: {row.verdict.judgement})"
        result.append(text + ".")
    return result

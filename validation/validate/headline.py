"""The page's first screen: how far apart the models are, and how sure the reference is."""

from dataclasses import dataclass

from validation.compare.differences import Spread, error_percent, spread
from validation.harness.quantities import OF_A_TAP, Quantity
from validation.validate.plan import REDUCED, REFERENCE, SCENES, Runs


@dataclass(frozen=True)
class Difference:
    """One headline number of one scene.

    Attributes
    ----------
    reduced, reference : values in the quantity's unit; None where a run is missing.
    reduced_error, reference_error : what the runs state as their own errors.
    band : spread of the three-dimensional runs.
    """

    scene: str
    quantity: Quantity
    reduced: float | None
    reference: float | None
    band: Spread | None
    reduced_error: float | None = None
    reference_error: float | None = None

    @property
    def error_percent(self) -> float | None:
        """Signed, relative to the reference."""
        return error_percent(self.reduced, self.reference)

    @property
    def band_percent(self) -> float | None:
        """The whole band relative to the reference, percent."""
        return self.band.percent_of(self.reference) if self.band and self.reference else None

    @property
    def inside(self) -> bool | None:
        """Whether the reduced model lies inside that band."""
        if self.band is None or self.reduced is None:
            return None
        return self.band.low <= self.reduced <= self.band.high


def differences(runs: Runs) -> list[Difference]:
    """Peak force, impulse and duration of every scene."""
    rows = []
    for scene in SCENES:
        reduced, reference = runs.find(scene, REDUCED), runs.find(scene, REFERENCE)
        for entry in OF_A_TAP:
            value = entry.read(reduced) if reduced else None
            target = entry.read(reference) if reference else None
            band = spread(runs.spread_over(scene), entry)
            errors = (entry.error(run) if run else None for run in (reduced, reference))
            rows.append(Difference(scene, entry, value, target, band, *errors))
    return rows


def sentences(rows: list[Difference]) -> list[str]:
    """One sentence per scene on the peak force, in words that the numbers bear out."""
    result = []
    for row in rows:
        if row.quantity != OF_A_TAP[0]:
            continue
        if row.error_percent is None:
            result.append(f"{row.scene.capitalize()} finger: no comparison, a run is missing.")
            continue
        side = "above" if row.error_percent > 0 else "below"
        text = (
            f"{row.scene.capitalize()} finger: the reduced model's peak force lies "
            f"{abs(row.error_percent):.1f} % {side} the reference's"
        )
        if row.band is not None and row.band_percent is not None:
            place = "inside" if row.inside else "outside"
            text += (
                f"; over {row.band.count} meshes and penalty factors the reference itself ranges "
                f"from {row.band.low:.0f} to {row.band.high:.0f} {row.quantity.unit}, "
                f"a spread of {row.band_percent:.0f} %, and the reduced model lies {place} it"
            )
        result.append(text + ".")
    return result

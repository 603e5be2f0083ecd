"""The page's first screen: how far apart, what it costs, how sure the reference is."""

from dataclasses import dataclass

from validation.compare.differences import Spread, error_percent, spread
from validation.harness.quantities import OF_A_TAP
from validation.validate.plan import REDUCED, REFERENCE, SCENES, Runs


@dataclass(frozen=True)
class Difference:
    """One headline number of one scene.

    Attributes
    ----------
    reduced, reference : values in ``unit``; None where a run is missing.
    error_percent : signed, relative to the reference.
    band : spread of the three-dimensional runs.
    band_percent : the whole band relative to the reference, percent.
    inside : whether the reduced model lies inside that band.
    """

    scene: str
    title: str
    unit: str
    reduced: float | None
    reference: float | None
    error_percent: float | None
    band: Spread | None
    band_percent: float | None
    inside: bool | None


@dataclass(frozen=True)
class Cost:
    """Time and memory of both models on one scene."""

    scene: str
    reduced_s: float | None
    reference_s: float | None
    reduced_MB: float | None
    reference_MB: float | None

    @property
    def ratio(self) -> float | None:
        """How many times the reference takes longer."""
        if not self.reduced_s or not self.reference_s:
            return None
        return self.reference_s / self.reduced_s

    @property
    def memory_ratio(self) -> float | None:
        """How many times the reference takes more memory."""
        if not self.reduced_MB or not self.reference_MB:
            return None
        return self.reference_MB / self.reduced_MB


def differences(runs: Runs) -> list[Difference]:
    """Peak force, duration and impulse of every scene."""
    rows = []
    for scene in SCENES:
        reduced, reference = runs.find(scene, REDUCED), runs.find(scene, REFERENCE)
        for entry in OF_A_TAP:
            value = entry.read(reduced) if reduced else None
            target = entry.read(reference) if reference else None
            band = spread(runs.spread_over(scene), entry)
            rows.append(
                Difference(
                    scene,
                    entry.title,
                    entry.unit,
                    value,
                    target,
                    error_percent(value, target),
                    band,
                    band.percent_of(target) if band and target else None,
                    band.low <= value <= band.high if band and value is not None else None,
                )
            )
    return rows


def costs(runs: Runs) -> list[Cost]:
    """Time and memory of every scene."""
    rows = []
    for scene in SCENES:
        pair = (runs.find(scene, REDUCED), runs.find(scene, REFERENCE))
        seconds = [run.value("wall_time_s") if run else None for run in pair]
        memory = [run.value("peak_memory_MB") if run else None for run in pair]
        rows.append(Cost(scene, *seconds, *memory))
    return rows


def sentences(rows: list[Difference]) -> list[str]:
    """One sentence per scene on the peak force, in words that the numbers bear out."""
    result = []
    for row in rows:
        if row.title != OF_A_TAP[0].title:
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
                f"from {row.band.low:.0f} to {row.band.high:.0f} {row.unit}, "
                f"a spread of {row.band_percent:.0f} %, and the reduced model lies {place} it"
            )
        result.append(text + ".")
    return result

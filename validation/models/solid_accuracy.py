"""What an accuracy chose for a solid run, as its record tells it."""

from typing import Any

from validation.harness.record import RunRecord
from validation.models.adapter import shown
from validation.scenes.scene import Scene


def held(tables: Scene, sizing: Any, settings: Any, record: RunRecord) -> dict[str, Any]:
    """`RunRecord.accuracy` of a run on a mesh of these sizes; empty where none was asked for."""
    import meshes
    import reference_fem

    accuracy, fem = tables.solver.accuracy_of("fem"), tables.solver.fem
    if accuracy is None or sizing is None:
        return {}
    shafts = "the errors that shafts leave go with its square"
    found = {
        "tip_size": (sizing.tip_size, "a share of the predicted patch, to the power 3/2"),
        "section_size": (sizing.section_size, shafts),
        "axial_size": (sizing.axial_size, shafts),
        "growth": (sizing.growth, "of the edges behind the patch"),
        "halvings": (sizing.halvings, "skipped: fine edges away from where it touches"),
        "contact": (settings.contact, "no penetration to be resolved, no penalty to be chosen"),
        "flight": (settings.flight, "skipped: vibration on the way, 0.02 % of the soft tap"),
    }
    if settings.element is not None:
        found["element"] = (settings.element, "skipped: seven of eight points, 1 % of a tap")
    stated = fem.stated(meshes.Sizing) | fem.stated(reference_fem.Settings)
    choices = [
        {"setting": name, "value": shown(value), "reason": "stated" if name in stated else reason}
        for name, (value, reason) in found.items()
    ]
    shares = [
        record.errors[name] / abs(record.summary[name])
        for name in reference_fem.HELD
        if name in record.errors and record.summary[name]
    ]
    expected = max(shares) if len(shares) == len(reference_fem.HELD) else None
    return {"wanted": accuracy, "expected": expected, "choices": choices}

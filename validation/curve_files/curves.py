"""The curves of a file's samples, with their errors."""

import numpy as np

from validation.curve_files.contract import Samples, Sidecar
from validation.curve_files.notes import notes_of, saturation, unknown_start
from validation.curve_files.tap import AXES, sampled_tap
from validation.models.curves import Curves, other_than_stated, tap_scalars


def curves_of(samples: Samples, origin: str, sidecar: Sidecar) -> tuple[Curves, list[str]]:
    """The curves, and a line for each thing that was done or taken for granted.

    Time counts from the scene's start; forces are the whole body's, zero out of contact.

    Raises UserError: as `sampled_tap`.
    """
    beside, tap = f"{origin}.toml", sampled_tap(samples, origin, sidecar)
    contact, errors = tap.contact, tap.errors()
    notes = notes_of(samples, tap, errors.keys(), beside, sidecar)
    errors |= sidecar.uncertainty.model_dump(exclude_unset=True)
    if unknown := unknown_start(tap, sidecar, beside):
        notes.append(unknown)
        if errors:
            errors["contact_time_s"] = np.inf
    if not errors:
        notes.append(
            "no uncertainty is known, so nothing is judged: give sigma columns, or state "
            f"uncertainty in {beside}"
        )
    scalars = sidecar.scalars.model_dump(exclude_unset=True)
    stated = scalars.keys() & sidecar.uncertainty.model_fields_set
    for name in tap.axes:
        if saturated := saturation(name, contact[name][tap.first], tap.body, beside):
            notes.append(saturated)
            errors |= {key: np.inf for key in AXES[name] if key not in stated}
    forces = contact["normal_force"], contact.get("tangential_force")
    curves = Curves(tap.time, *forces, scalars, errors)
    remedy = (
        f"take it out of {beside} unless it is the better one (half_model, time_offset_s and"
        " threshold_N change the curves alone)"
    )
    doubts = other_than_stated(curves, tap_scalars(curves))
    return curves, [*notes, *[f"{doubt}: {remedy}" for doubt in doubts]]

"""The efficiency table (the paper's Table 3): time and memory of every run, with sources."""

from typing import Any

from validation.harness.quantities import quantities
from validation.harness.record import RunRecord
from validation.validate.accuracy import OTHER, PAPER, SELF
from validation.validate.paper_tables import TABLE_3, printed
from validation.validate.plan import REDUCED, REFERENCE

MEASURED = quantities(
    "wall_time_s", "peak_memory_MB", "steps", "elements", "time_step_s", "energy_residual"
)
COLUMNS = (
    *("scene", "model", "source", "status"),
    *(entry.key for entry in MEASURED),
    *("processor", "measured", "paper_time_s", "paper_memory_MB", "paper_source"),
)


def _paper_columns(run: RunRecord) -> dict[str, Any]:
    """Table 3's own columns, beside the models that stand in for them."""
    who = {REDUCED: "hcm", REFERENCE: "reference"}.get((run.model, run.variant))
    time, memory = (printed(run.scene, key).get(who or "") for key in TABLE_3)
    if time is None or memory is None:
        return {}
    return {
        "paper_time_s": time.number,
        "paper_memory_MB": memory.number,
        "paper_source": f"{PAPER}: Table 3 ({time.id} {memory.id}), 4-core laptop of 2016",
    }


def efficiency_rows(runs: list[RunRecord]) -> list[dict[str, Any]]:
    """One row per run, each measured alone in a fresh process with its compiled code warm."""
    return [
        {
            "scene": run.scene,
            "model": run.label,
            "source": SELF if run.model == "hcm" else OTHER,
            "status": run.status,
            **{entry.key: run.summary.get(entry.key) for entry in MEASURED},
            "processor": run.provenance.get("processor"),
            "measured": run.measured,
            **_paper_columns(run),
        }
        for run in runs
    ]

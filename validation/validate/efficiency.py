"""The efficiency table (the paper's Table 3): time and memory of every run, with sources."""

from typing import TYPE_CHECKING, Any

from validation.compare.claims import find, read_claims
from validation.harness.record import RunRecord
from validation.validate.accuracy import OTHER, PAPER, SELF

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "scene",
    "model",
    "source",
    "status",
    "wall_time_s",
    "peak_memory_MB",
    "steps",
    "elements",
    "time_step_s",
    "energy_residual",
    "processor",
    "measured",
    "paper_time_s",
    "paper_memory_MB",
    "paper_source",
)


def _paper_columns(run: RunRecord) -> dict[str, Any]:
    """Table 3's own columns, beside the models that stand in for them."""
    prefix = {"hcm": "HCM", "fem3d ls-dyna-like": "reference"}.get(run.label)
    if prefix is None:
        return {}
    claims = read_claims()
    time = find(claims, "Table 3", run.scene, f"{prefix} run time")
    memory = find(claims, "Table 3", run.scene, f"{prefix} memory")
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
            **{key: run.summary.get(key) for key in COLUMNS[4:10]},
            "processor": run.provenance.get("processor"),
            "measured": run.measured,
            **_paper_columns(run),
        }
        for run in runs
    ]


def efficiency_table(rows: list[dict[str, Any]]) -> "pd.DataFrame":
    """The rows as a table with all columns, in order."""
    import pandas as pd

    return pd.DataFrame(rows, columns=list(COLUMNS))

"""``fingertap identify ramp``: whether a ramp and damping let the driven cases agree together."""

import json
import os

from validation.harness.command_line import AsJson
from validation.harness.console import output, progress_bar
from validation.harness.processes import workers
from validation.harness.provenance import provenance
from validation.studies.paper.ramp_experiment import RAMPS, driven_ids
from validation.studies.paper.ramp_outcome import between, closest, compute, place, to_json


def run_identify_ramp(*, as_json: AsJson = False) -> None:
    """Drive the paper's fingers by a ramp, damped, and count the rows of figs. 13 to 16 that agree.

    Each of a grid of (ramp, relaxation time, factor) is judged as the ledger judges, and what lies
    between them is searched for boxes in which no choice can agree; some ten minutes.
    """
    with workers(os.cpu_count() or 1) as pool, progress_bar("ramps") as progress:
        outcome = compute(pool, progress)
    if as_json:
        output(json.dumps(to_json(outcome, provenance({})), indent=1))
        return
    points, rows = outcome.points, driven_ids()
    output("largest deviation of the three arrival times, the best of all factors and damping:")
    for ramp in RAMPS:
        late = [p.arrivals_percent for p in points if p.ramp_s == ramp]
        known = [percent for percent in late if percent is not None]
        output(f"  ramp {1e3 * ramp:g} ms: " + (f"{min(known):.2g} %" if known else "no tap"))
    output("points of (ramp, relaxation time, factor) at which a row agrees to 5 %:")
    for id_ in rows:
        own = sum(id_ in point.agreeing for point in points)
        output(f"  {id_}: {own} of {len(points)}")
    best = closest(points)
    missing = ", ".join(id_ for id_ in rows if id_ not in best.agreeing)
    output(
        f"all {len(rows)} rows: {sum(len(p.agreeing) == len(rows) for p in points)}; most,"
        f" {len(best.agreeing)}, at {place(best)}, without {missing or 'exception'}"
    )
    output(between(outcome.exclusion))

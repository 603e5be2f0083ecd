"""The ledger: each claim of the paper beside our value, with a verdict."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import pandas as pd

from validation.compare.claims import Claim
from validation.harness.tables import table_of

REPRODUCED = "reproduced"
CLOSE = "close"
CONTRADICTS = "the paper contradicts itself"
NOT_REPRODUCED = "not reproduced"
NOT_JUDGED = "not judged"
INCOMPARABLE = "can't be compared"
VERDICTS = (REPRODUCED, CLOSE, CONTRADICTS, NOT_REPRODUCED, INCOMPARABLE, NOT_JUDGED)

SAME_PERCENT = 1.0
CLOSE_PERCENT = 5.0
REFERENCE_ROWS = frozenset(("T2.5", "T2.6", "T2.7", "T2.8", "T3.3", "T3.4", "T3.7", "T3.8"))
ERROR_ROWS = frozenset(("T2.9", "T2.10", "T2.11", "T2.12", "A.2"))  # of hcm against the reference
# errors against a run that is not available, and another machine's time and memory
INCOMPARABLE_ROWS = frozenset(
    ["A.2", *(f"T2.{row}" for row in (9, 10, 11)), *(f"T3.{row}" for row in range(1, 9))]
)


@dataclass(frozen=True)
class Finding:
    """Our value for a claim.

    value : in the claim's unit; True or False for a state; None where there is no run to read.
    reason : where it comes from, and what experiments show if it differs.
    contradiction : the arithmetic by which the paper contradicts itself; empty if it does not.
    """

    value: float | bool | None
    reason: str = ""
    contradiction: str = ""


@dataclass(frozen=True)
class LedgerRow:
    """One line of the ledger.

    deviation : 100 (ours - paper)/|paper| in percent; if the number is itself a percentage, ours -
    paper in percentage points. deviation_unit : which of the two.
    """

    claim: Claim
    our_value: float | int | bool | None
    deviation: float | None
    deviation_unit: str
    verdict: str
    reason: str


def printed_rounding(text: str) -> float:
    """Half a unit of the last printed digit."""
    exponent = Decimal(text).as_tuple().exponent
    return 0.5 * 10.0 ** int(exponent)


def close_to(paper: str) -> float:
    """Largest distance from a printed number at which another one is close to it."""
    return max(CLOSE_PERCENT / 100 * abs(float(paper)), printed_rounding(paper))


def judge_number(paper: str, ours: float) -> tuple[str, str]:
    """Verdict on a number and the tolerance that it rests on."""
    printed = float(paper)
    deviation, rounding = abs(ours - printed), printed_rounding(paper)
    if deviation <= SAME_PERCENT / 100 * abs(printed):
        return REPRODUCED, f"within {SAME_PERCENT:g} %"
    if deviation <= rounding:
        return REPRODUCED, f"within the printed rounding, +-{rounding:g}"
    if deviation <= close_to(paper):
        return CLOSE, f"within {CLOSE_PERCENT:g} %"
    return NOT_REPRODUCED, f"beyond {CLOSE_PERCENT:g} %"


def judge(claim: Claim, finding: Finding) -> LedgerRow:
    """One line: verdict, deviation, and the reason with the tolerance in it."""
    ours = finding.value
    deviation, unit = None, "points" if claim.unit == "%" else "%"
    if claim.id in INCOMPARABLE_ROWS:
        verdict, tolerance = INCOMPARABLE, ""
    elif ours is None:
        # the reference's runs may be left out, or fail; hcm's are this command's own
        needed = claim.id in REFERENCE_ROWS | ERROR_ROWS
        verdict = NOT_JUDGED if needed else NOT_REPRODUCED
        tolerance = "no run to judge by"
    elif isinstance(ours, bool):
        verdict = REPRODUCED if ours else NOT_REPRODUCED
        tolerance = "as stated" if ours else "not as stated"
    else:
        printed = claim.number
        deviation = (ours - printed) * (1 if unit == "points" else 100 / abs(printed))
        if claim.kind == "count":
            same = ours == printed
            verdict, tolerance = (REPRODUCED if same else NOT_REPRODUCED), "counts must be equal"
        else:
            verdict, tolerance = judge_number(claim.paper_value, ours)
    if finding.contradiction:
        verdict, tolerance = CONTRADICTS, ""
    source = "other model: fem3d ls-dyna-like"
    if claim.id not in REFERENCE_ROWS:
        source = f"self: hcm, {source}" if claim.id in ERROR_ROWS else "self: hcm"
    parts = (tolerance, finding.contradiction, finding.reason, source)
    reason = "; ".join(part for part in parts if part)
    return LedgerRow(claim, ours, deviation, "" if deviation is None else unit, verdict, reason)


def ledger(claims: Iterable[Claim], findings: Mapping[str, Finding]) -> tuple[LedgerRow, ...]:
    """One row for every claim, in order."""
    return tuple(judge(claim, findings[claim.id]) for claim in claims)


def score(rows: Sequence[LedgerRow]) -> tuple[int, int]:
    """Rows of kind value, count or state that concern hcm: (settled, all).

    Settled means reproduced, or shown to contradict the paper itself.
    """
    mine = [
        row
        for row in rows
        if row.claim.kind in ("value", "count", "state")
        and row.claim.id not in REFERENCE_ROWS | INCOMPARABLE_ROWS
    ]
    return sum(row.verdict in (REPRODUCED, CONTRADICTS) for row in mine), len(mine)


def by_place(rows: Sequence[LedgerRow]) -> dict[str, tuple[list[LedgerRow], dict[str, int]]]:
    """Rows of each table, figure or section in the article's order, and counts by verdict."""
    places: dict[str, list[LedgerRow]] = {}
    for row in rows:
        places.setdefault(row.claim.where, []).append(row)
    return {place: (mine, counts(mine)) for place, mine in places.items()}


def counts(rows: Sequence[LedgerRow]) -> dict[str, int]:
    """Number of rows with each verdict; verdicts that no row has are left out."""
    found = [row.verdict for row in rows]
    return {verdict: found.count(verdict) for verdict in VERDICTS if verdict in found}


def ledger_table(rows: Sequence[LedgerRow]) -> pd.DataFrame:
    """The ledger as a table, states in words."""
    table = table_of({**vars(row.claim), **vars(row)} for row in rows)
    words = [str(ours).lower() if isinstance(ours, bool) else ours for ours in table["our_value"]]
    return table.assign(our_value=words).drop(columns=["kind", "note", "claim"])

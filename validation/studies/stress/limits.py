"""What limits a region of a map, in a sentence made from its cells."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from validation.studies.stress.stability_map import Answer, Map

# The middle share of a group's values that "mostly" stands for.
MOSTLY = 0.8


def _cause(row: Mapping[str, Any]) -> str:
    """The cause of a cell's answer: the solver's reason to stop, a refused parameter, a caution."""
    reason = str(row["reason"])
    if row["answer"] == Answer.STOPPED:
        return f"stopped: {reason.partition(' at t =')[0]}"
    if row["answer"] == Answer.REFUSED:
        return f"refused: {_kind(reason.partition(' =')[0])}"
    if row["answer"] == Answer.FLAGGED and reason:
        return f"flagged: {_kind(reason.removeprefix('cautioned, '))}"
    return str(row["answer"])


def _kind(reason: str) -> str:
    """The first clause of a reason, with n for numbers: the same for reasons of one kind."""
    clause = re.split(r"[,:;] | at t =", re.sub(r" \([^)]*\)", "", reason))[0]
    return re.sub(r"\b\d[\d.]*(?:e[+-]?\d+)?\b", "n", clause)


def _where(name: str, axis: Sequence[float], values: Sequence[float]) -> str | None:
    """The range in which most of the values lie, None if it is the whole axis."""
    ordered = sorted(values)
    cut = int(0.5 * (1 - MOSTLY) * len(ordered))
    low, high = ordered[cut], ordered[-1 - cut]
    if len(axis) < 2 or (low == min(axis) and high == max(axis)):
        return None
    label = name.partition(" (")[0].replace("_", " ")
    if low == high:
        return f"{label} {low:.3g}"
    if low == min(axis):
        return f"{label} up to {high:.3g}"
    return f"{label} from {low:.3g}" if high == max(axis) else f"{label} {low:.3g} to {high:.3g}"


def limit(wanted: Map, rows: Sequence[Mapping[str, Any]]) -> str:
    """A sentence on why cells have no right answer: causes, how many cells, and mostly where."""
    groups: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for row in rows:
        if row["answer"] not in (Answer.RIGHT, Answer.SMALLER):
            groups[_cause(row)].append(row)
    if not groups:
        return "every cell is right"
    sentences = []
    for cause, cells in sorted(groups.items(), key=lambda group: -len(group[1])):
        places = [
            place
            for name, axis in wanted.axes.items()
            if wanted.y_name != "seed"
            and (place := _where(name, axis, [float(cell[name]) for cell in cells]))
        ]  # fmt: skip
        at = f", mostly at {', '.join(places)}" if places else ""
        sentences.append(f"{cause} ({len(cells)} of {len(rows)}{at})")
    return "; ".join(sentences)

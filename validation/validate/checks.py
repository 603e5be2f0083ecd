"""Checks of ``fingertap validate`` for continuous integration: JSON and JUnit's XML."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.compare.differences import Difference
from validation.harness.files import json_text, write_text
from validation.harness.provenance import provenance
from validation.harness.quantities import COMPARED
from validation.harness.uncertainty import two_digits
from validation.validate.headline import differences
from validation.validate.plan import Runs

NO_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")  # allowed in names, not in XML
JSON_KEYS = {  # of `Difference.numbers`, where JSON has another name
    "reduced": "value",
    "reduced_error": "value_error",
    "error_percent": "difference_percent",
}


def outcome(row: Difference) -> str:
    """The result of a tolerance check: inside, outside, cannot tell, or missing if a run is."""
    return "missing" if row.verdict is None else row.verdict.check or "cannot tell"


def check_text(row: Difference) -> str:
    """The difference, its uncertainty, the tolerance and the outcome, in a sentence."""
    where, verdict = f"{row.scene}, {row.model}: {row.quantity.title}", row.verdict
    if verdict is None:
        return f"{where}: nothing to compare"
    known = "with no stated error"
    if verdict.uncertainty is not None:
        known = f"known to {two_digits(verdict.uncertainty)} %"
    difference = f"{where} {verdict.difference:+.2f} % ({known})"
    return f"{difference}, tolerance {row.tolerance:g} %: {outcome(row)}"


def write_checks(
    folder: Path, runs: Runs, notes: Sequence[str], failures: Sequence[str]
) -> tuple[list[Difference], str]:
    """Write ``validate.json`` (all verdicts) and ``junit.xml`` (a test for each tolerance).

    Returns the differences for which a tolerance was given, and the JSON.

    notes : cautions. failures : one line for each run that failed.
    """
    rows = differences(runs, COMPARED)
    checks = [row for row in rows if row.tolerance is not None]
    content = {
        "cautions": list(notes),
        "verdicts": [_verdict(row) for row in rows],
        "failures": list(failures),
        "provenance": provenance({}),
    }
    verdicts = json_text(content)
    write_text(folder / "validate.json", verdicts + "\n")
    write_text(folder / "junit.xml", _junit(checks, failures))
    return checks, verdicts


def _verdict(row: Difference) -> dict[str, Any]:
    named = {"scene": row.scene, "model": row.model}
    named |= {"quantity": row.quantity.key, "unit": row.quantity.unit}
    numbers = {JSON_KEYS.get(column, column): value for column, value in row.numbers.items()}
    return named | numbers | {"tolerance_percent": row.tolerance}


def _junit(checks: Sequence[Difference], failures: Sequence[str]) -> str:
    """JUnit's XML: a failed run is an error, a check that is not inside a failure."""
    wrong = [row for row in checks if outcome(row) != "inside"]
    counts = {"tests": len(checks) + len(failures), "failures": len(wrong), "errors": len(failures)}
    attributes = {name: str(count) for name, count in counts.items()}
    suite = ET.Element("testsuite", {"name": "fingertap validate", **attributes})
    for row in checks:
        name = f"{row.scene}.{row.model}"
        case = ET.SubElement(suite, "testcase", classname=name, name=row.quantity.key)
        if row in wrong:
            ET.SubElement(case, "failure", message=check_text(row), type=outcome(row))
    for failure in failures:
        case = ET.SubElement(suite, "testcase", classname="runs", name=failure)
        ET.SubElement(case, "error", message=failure)
    ET.indent(suite)
    text = ET.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"
    return NO_XML.sub("?", text)

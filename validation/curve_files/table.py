"""Force curves in a CSV file.

Columns in any order, ``time_s, normal_force_N``, and where known ``tangential_force_N,
normal_force_sigma_N, tangential_force_sigma_N`` (one standard deviation); units by the endings.
"""

import csv

import numpy as np

from validation.curve_files.contract import FACTORS, Samples, Sidecar, number
from validation.errors import UserError
from validation.scenes.messages import show

FORCES = ("normal_force", "tangential_force", "normal_force_sigma", "tangential_force_sigma")
UNITS = {"time": ("s", "ms", "us"), **dict.fromkeys(FORCES, ("N", "kN", "mN"))}
COLUMNS = {f"{name}_{unit}": (name, unit) for name, units in UNITS.items() for unit in units}
KNOWN = ", ".join(f"{name}_{'|'.join(units)}" for name, units in UNITS.items())


def read_table(text: str, origin: str, sidecar: Sidecar) -> Samples:
    """The samples of a CSV file.

    Raises UserError: a column is unknown, missing or there twice, a cell is empty or no number, or
        the sidecar has keys that are of no use here.
    """
    for key in sidecar.model_fields_set & {"time_unit", "force_unit", "interface", "side"}:
        raise UserError(f"{origin}.toml: {key} is for solver output; a CSV header has units")
    for key, axis in (("normal", "y"), ("tangential", "x")):
        if (given := getattr(sidecar, key)).strip("-") != axis:
            raise UserError(
                f"{origin}.toml: {key} = {given!r}: in a CSV its sign alone counts, the axes are"
                f" the columns; write {axis!r} or '-{axis}'"
            )
    reader = csv.reader(text.splitlines(), strict=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise UserError(f"{origin}, line {reader.line_num}: is not CSV: {error}") from error
    (_, header), *rows = [row for row in rows if any(row[1]) or len(row[1]) > 1] or [(0, [])]
    if len(header) == 1 and header[0] not in COLUMNS:
        raise UserError(
            f"{origin}: its first line, {show(header[0])}, has no comma: columns are separated by"
            f" commas, decimals begin with a point; known are {KNOWN}"
        )
    for name in header:
        if name not in COLUMNS:
            raise UserError(f"{origin}: column {show(name)} is unknown; known are {KNOWN}")
    names = [COLUMNS[name][0] for name in header]
    for name in UNITS:
        if names.count(name) != 1 and (name in names or name in ("time", "normal_force")):
            count = names.count(name)
            raise UserError(f"{origin}: {count} columns {name}, must be one; known are {KNOWN}")
    for name in names:
        if name.endswith("_sigma") and name.removesuffix("_sigma") not in names:
            raise UserError(
                f"{origin}: column {name} has no {name.removesuffix('_sigma')} beside it"
            )
    table = np.empty((len(rows), len(header)))
    for i, (line, row) in enumerate(rows):
        if len(row) != len(header):
            raise UserError(
                f"{origin}, line {line}: {len(row)} cells, the header has {len(header)}"
            )
        for j, (cell, name) in enumerate(zip(row, header, strict=True)):
            place = f"{origin}, line {line}, column {name}"
            if not cell:
                raise UserError(f"{place}: is empty; fill it, or leave the row out")
            table[i, j] = number(cell, place) * FACTORS[COLUMNS[name][1]]
            if "sigma" in name and table[i, j] < 0.0:
                raise UserError(f"{place}: {cell} is negative; no deviation is")
    columns = dict(zip(names, table.T, strict=True))
    return Samples(np.array([line for line, _ in rows]), columns.pop("time"), columns)

"""Force curves that other solvers print.

- LS-DYNA, ASCII ``rcforc``: a line per interface, side and time, ``slave 1 time 0.1E-03 x 0.2E+01
  y ... z ...``; newer versions say surfa and surfb.
- CalculiX, ``.dat`` of ``*CONTACT PRINT`` with CF: blocks ``statistics for slave set A, master set
  B and time t``, below it ``total surface force (fx,fy,fz)``, which acts on the slave. The
  interface is named A or, where A has several masters, A/B.
"""

import re
from collections import defaultdict

import numpy as np

from validation.curve_files.contract import FACTORS, Samples, Sidecar, number
from validation.errors import UserError

SIDES = {"surfa": "slave", "surfb": "master"}
_FLAGS = re.IGNORECASE | re.MULTILINE
RCFORC = re.compile(r"^[ \t]*(slave|master|surfa|surfb)(\s+\S+\s+time\s+[-+.\d].*)$", _FLAGS)
DAT = re.compile(r"^[ \t]*statistics for (slave) set(.*(?:\n\s*.+){0,2})", _FLAGS)
_RCFORC_ROW = re.compile(r"\s+(\S+)\s+time\s+(\S+)\s+x\s+(\S+)\s+y\s+(\S+)\s+z\s+(\S+)", _FLAGS)
_DAT_ROW = re.compile(
    r"\s+(\S+), master set (\S+) .*time\s+(\S+)\s+total surface force .*\n"
    r"\s*(\S+)\s+(\S+)\s+(\S+)",
    _FLAGS,
)


def read_solver_output(text: str, origin: str, sidecar: Sidecar) -> Samples:
    """The samples of one interface.

    Raises UserError: a block can't be read, it is not clear which interface is the finger's, or
        both forces are to be along one axis.
    """
    if sidecar.normal[-1] == sidecar.tangential[-1]:
        raise UserError(
            f"{origin}.toml: normal = {sidecar.normal!r} and tangential = {sidecar.tangential!r}:"
            " are along one axis; state two different ones"
        )
    dyna = RCFORC.search(text) is not None
    blocks, row = (RCFORC, _RCFORC_ROW) if dyna else (DAT, _DAT_ROW)
    found = defaultdict(list)
    line, seen = 1, 0
    for block in blocks.finditer(text):
        line, seen = line + text.count("\n", seen, block.start()), block.start()
        place = f"{origin}, line {line}"
        if (cells := row.match(block[2])) is None:
            wanted = "interface, time, x, y, z" if dyna else "CF's total surface force"
            raise UserError(f"{place}: {wanted} must follow; is the file cut off?")
        numbers = map(with_exponents, cells.groups()[-4:])
        side = SIDES.get(block[1].lower(), block[1].lower())
        name = "/".join(cells.groups()[:-4])
        found[name, side].append((line, *(number(cell, place) for cell in numbers)))
    names = [
        name
        for name in sorted({name for name, _ in found})
        if sidecar.interface in (name, name.partition("/")[0]) or sidecar.interface is None
    ]
    printed = sidecar.side if dyna else "slave"  # the force on CalculiX's master is its opposite
    name = names[0] if len(names) == 1 else ""
    if (name, printed) not in found:
        known = ", ".join(f"{name} {side}" for name, side in sorted(found))
        raise UserError(
            f"{origin}: which contact? state interface and side in {origin}.toml: {known}"
        )
    table = np.array(found[name, printed])
    force = table[:, 2:] * FACTORS[sidecar.force_unit] * (1.0 if printed == sidecar.side else -1.0)
    normal, tangential = (
        force[:, "xyz".index(a[-1])] for a in (sidecar.normal, sidecar.tangential)
    )
    note = (
        f"contact {name}, the force on its {sidecar.side} in {sidecar.time_unit}, "
        f"{sidecar.force_unit}: F_n along {sidecar.normal}, F_t along {sidecar.tangential}"
    )
    forces = {"normal_force": normal, "tangential_force": tangential}
    time = table[:, 1] * FACTORS[sidecar.time_unit]
    return Samples(table[:, 0].astype(int), time, forces, (note,))


def with_exponents(printed: str) -> str:
    """Numbers with the E that Fortran leaves out before an exponent of three digits."""
    return re.sub(r"(\.\d*)([+-]\d{3})(?!\d)", r"\1E\2", printed)

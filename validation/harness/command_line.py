"""Parameters shared by several commands, with their names and help on the command line."""

from collections.abc import Sequence
from typing import Annotated

from cyclopts import Parameter

Source = Annotated[
    str,
    Parameter(
        help="A built-in scene (hard, soft, driven-1, driven-2, driven-3) or a TOML file's path."
    ),
]
_SET = "KEY=VALUE with a dotted key, as often as needed: --set surface.friction=0.7"
Overrides = Annotated[Sequence[str], Parameter(name="--set", negative="", help=_SET)]

Flag = Annotated[bool, Parameter(negative="")]
"""A switch that is off unless it is given."""

_AGAIN = "Run everything again; without it an unchanged run that is in OUT/store is read back."
Fresh = Annotated[bool, Parameter(negative="", help=_AGAIN)]

_LEFT_OUT = (
    "Leave the estimates of errors out. They take up to a third of a run's time, more where a mesh"
    " is coarse, and choose the solids' meshes, which may differ without."
)
NoEstimate = Annotated[bool, Parameter(name="--no-estimate", negative="", help=_LEFT_OUT)]

AsJson = Annotated[
    bool, Parameter(name="--json", negative="", help="Print one JSON object and nothing else.")
]

_ACCURACY = (
    "Largest relative error wanted in peak force, impulse, duration and arrival, against the same "
    "model's converged answer: settings that --set and the scene leave out follow from it. By "
    "default 1e-3 for hcm, 1e-2 for solids; none: fixed settings."
)
Accuracy = Annotated[str | None, Parameter(help=_ACCURACY)]

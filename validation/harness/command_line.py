"""Parameters that several commands share, as the command line names them."""

from collections.abc import Sequence
from typing import Annotated

from cyclopts import Parameter

Overrides = Annotated[Sequence[str], Parameter(name="--set", negative="")]
"""KEY=VALUE texts, one after each ``--set``."""

Flag = Annotated[bool, Parameter(negative="")]
"""A switch that is off unless it is given."""

NoEstimate = Annotated[bool, Parameter(name="--no-estimate", negative="")]
"""Whether runs go without estimates of their errors, as with ``solver.hcm.estimate=false``."""

AsJson = Annotated[bool, Parameter(name="--json", negative="")]
"""Whether one JSON object is printed and nothing else."""

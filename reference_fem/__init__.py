"""The reference: explicit finite elements with penalty contact, in 3D and plane stress.

>>> import meshes, reference_fem
>>> mesh = meshes.finger_hexahedra(meshes.FingerGeometry((0.04,) * 3, (0.015,) * 3),
...                                meshes.SIZINGS["fast"])          # doctest: +SKIP
>>> result = reference_fem.simulate(
...     mesh, (reference_fem.Material(1e9, 0.4, 1400.0),) * 3,
...     reference_fem.Surface(height=0.1, friction=0.5), reference_fem.Drive())  # doctest: +SKIP
"""

from reference_fem.dynamics.restart import Restart, RestartError
from reference_fem.estimates.accuracy import ACCURACY_QUANTITIES, COARSEST, SMALLEST, sizes_for
from reference_fem.estimates.flight_error import RodFlight, rod_flight
from reference_fem.flight.touch import Touch, impact_state, predicted_touch
from reference_fem.results.result import ForceRecord, History, Snapshot, Status, Summary, TapResult
from reference_fem.rigid.rigid_chain import ChainState
from reference_fem.settings import (
    NEO_HOOKE,
    ONE_POINT,
    Drive,
    LumpedContact,
    Material,
    Settings,
    Surface,
    TorqueTable,
)
from reference_fem.simulate import simulate

__all__ = [
    "ACCURACY_QUANTITIES",
    "COARSEST",
    "NEO_HOOKE",
    "ONE_POINT",
    "SMALLEST",
    "ChainState",
    "Drive",
    "ForceRecord",
    "History",
    "LumpedContact",
    "Material",
    "Restart",
    "RestartError",
    "RodFlight",
    "Settings",
    "Snapshot",
    "Status",
    "Summary",
    "Surface",
    "TapResult",
    "TorqueTable",
    "Touch",
    "impact_state",
    "predicted_touch",
    "rod_flight",
    "simulate",
    "sizes_for",
]

"""The soft finger in Exudyn (Gerstmayr 2023): ANCFCable2D, generalized-alpha, contact at the tip.

A scene whose tip slides in +X from first contact to separation has a contact that is linear in the
tip's coordinates while it lasts,

    F_n = -k (y + H),    F_t = -mu F_n,

and is given to Exudyn as the stiffness matrix of an `ObjectGenericODE2` on the tip's node: compiled
code throughout, no Python in the step. The object is passive in flight.

located : the flight's last step is shortened until the tip is on the surface to round-off, and
separation is where F_n, interpolated, is zero. unlocated : contact begins and ends with a step.
Exudyn is told a time shortly before contact from which to look.

Exudyn's options are those that are cheapest for the same error: Eigen's dense solver up to DENSE
elements (0.83 times the time of the sparse one at 6, 1.08 at 15), beyond that the sparse one, which
keeps its analysed pattern (the defaults take 1.6 times as long at 15), and four Gauss points for
the axial force instead of five. A new Jacobian in every step takes 0.8 times the time where the
flight's steps are 1 ms, and up to twice the time where they are short.
"""

import contextlib
import importlib
import io
import math
import sys
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from validation.compare.tap_errors import TapQuantities

if TYPE_CHECKING:
    import hcm

RELATIVE, ABSOLUTE = 1e-5, 1e-8  # Newton; tighter ones fail to converge at round-off
CONTACT_RELATIVE = 1e-6
LOCATED_M = 1e-13
DENSE = 9
CONTACT_WINDOW_S = 2.5e-4
WINDOWS, ATTEMPTS = 100, 8


class PeerFailedError(Exception):
    """Exudyn did not finish the tap; the message says where."""


@dataclass(frozen=True)
class PeerTap:
    """A tap's quantities, number of steps, and force over time (n,) from a step before contact."""

    quantities: TapQuantities
    steps: int
    time_s: NDArray[np.float64]
    normal_force_N: NDArray[np.float64]
    tip_velocity_m_per_s: tuple[float, float]


def load() -> tuple[Any, Any]:
    """Exudyn, in its variant without range checks, and its items."""
    sys.exudynFast = True  # type: ignore[attr-defined]  # before the import
    with contextlib.redirect_stdout(sys.stderr if sys.stderr.isatty() else io.StringIO()):
        exudyn = importlib.import_module("exudyn")  # prints which variant it is
        return exudyn, importlib.import_module("exudyn.itemInterface")


class _Finger:
    """Exudyn's system for the scene, stepped on from its current state."""

    def __init__(
        self, scene: "hcm.Scene", adaptive: bool, spectral_radius: float, jacobian_a_step: bool
    ) -> None:
        exudyn, items = load()
        self.exu, self.scene, self.steps = exudyn, scene, 0
        self.container = exudyn.SystemContainer()
        self.system = self.container.AddSystem()
        self.tip = self._add_chain(items)
        self.contact = self.system.AddObject(
            items.ObjectGenericODE2(nodeNumbers=[self.tip], stiffnessMatrix=np.zeros((4, 4)),
                                    massMatrix=np.zeros((4, 4)), dampingMatrix=np.zeros((4, 4)),
                                    forceVector=np.zeros(4))
        )  # fmt: skip
        self.sensor = self.system.AddSensor(
            items.SensorNode(nodeNumber=self.tip, storeInternal=True, writeToFile=False,
                             outputVariableType=exudyn.OutputVariableType.Position)
        )  # fmt: skip
        self.system.Assemble()
        self.settings = exudyn.SimulationSettings()
        self.settings.solution.file.write = False
        self.settings.solution.sensors.writePeriod = 1.0  # none in flight, as storing costs time
        solvers, elements = exudyn.LinearSolverType, sum(p.elements for p in scene.finger.phalanges)
        dense = elements <= DENSE
        self.settings.linearSolver.solverType = solvers.EigenDense if dense else solvers.EigenSparse
        self.settings.linearSolver.reuseAnalyzedPattern = True
        stepping = self.settings.timeIntegration
        stepping.adaptiveStep = adaptive
        stepping.verboseMode = 0
        stepping.generalizedAlpha.spectralRadius = spectral_radius
        stepping.newton.relativeTolerance = RELATIVE
        stepping.newton.absoluteTolerance = ABSOLUTE
        stepping.newton.useModifiedNewton = True
        stepping.newton.modifiedNewtonJacUpdatePerStep = jacobian_a_step

    def _add_chain(self, items: Any) -> int:
        """Add the phalanges along -X, hinged in a row; returns the tip's node."""
        system, gravity = self.system, self.scene.drive.gravity
        node = system.AddNode(items.NodePointGround())
        hinge_x = 0.0
        for phalanx in self.scene.finger.phalanges:
            length, relaxation = phalanx.length / phalanx.elements, phalanx.relaxation_time
            nodes = [
                system.AddNode(
                    items.NodePoint2DSlope1(referenceCoordinates=[hinge_x - i * length, 0, -1, 0])
                )
                for i in range(phalanx.elements + 1)
            ]
            for pair in pairwise(nodes):
                cable = system.AddObject(items.ObjectANCFCable2D(
                    length=length, massPerLength=phalanx.density * phalanx.area,
                    bendingStiffness=phalanx.youngs_modulus * phalanx.second_moment,
                    axialStiffness=phalanx.youngs_modulus * phalanx.area,
                    bendingDamping=phalanx.youngs_modulus * phalanx.second_moment * relaxation,
                    axialDamping=phalanx.youngs_modulus * phalanx.area * relaxation,
                    nodeNumbers=list(pair), useReducedOrderIntegration=1,
                ))  # fmt: skip
                marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=cable))
                system.AddLoad(
                    items.LoadMassProportional(markerNumber=marker, loadVector=[0, -gravity, 0])
                )
            for axis in range(2):
                ends = [
                    system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=end, coordinate=axis))
                    for end in (node, nodes[0])
                ]
                system.AddObject(items.ObjectConnectorCoordinate(markerNumbers=ends))
            node, hinge_x = nodes[-1], hinge_x - phalanx.length
        return int(node)

    def tip_motion(self, kind: Literal["Position", "Velocity"]) -> tuple[float, float]:
        """The tip's place, m, or velocity, m/s."""
        x, y, _ = self.system.GetNodeOutput(self.tip, getattr(self.exu.OutputVariableType, kind))
        return float(x), float(y)

    def touch(self) -> None:
        """Switch the contact on, as linear terms in the tip's displacement from rest; from then on
        every step is stored and converges to `CONTACT_RELATIVE`.
        """
        stiffness, mu = self.scene.tip.k, self.scene.surface.friction
        matrix = np.zeros((4, 4))
        matrix[0, 1], matrix[1, 1] = -mu * stiffness, stiffness
        force = matrix @ np.array([0.0, -self.scene.surface.height, 0.0, 0.0])
        self.system.SetObjectParameter(self.contact, "stiffnessMatrix", matrix)
        self.system.SetObjectParameter(self.contact, "forceVector", force)
        self.settings.solution.sensors.writePeriod = 1e-12  # every step
        self.settings.timeIntegration.newton.relativeTolerance = CONTACT_RELATIVE

    def advance(self, start: float, duration: float, steps: int) -> None:
        """Continue the integration from the current state."""
        if self.steps:
            configuration, data = self.exu.ConfigurationType, self.system.systemData
            state = data.GetSystemState(configuration=configuration.Current)
            data.SetSystemState(state, configuration=configuration.Initial)
        stepping = self.settings.timeIntegration
        stepping.startTime, stepping.endTime = start, start + duration
        stepping.numberOfSteps = steps
        try:
            solved = self.system.SolveDynamic(self.settings)
        except SystemError as error:
            if isinstance(error.__cause__, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            raise
        if not solved:
            raise PeerFailedError(f"Exudyn failed after t = {start:g} s")
        self.steps += steps

    def fly(self, flight_step: float, contact_step: float, located: bool, until: float) -> float:
        """Fly from rest to contact; returns the time of contact, s."""
        self.advance(0.0, until, max(1, round(until / flight_step)))
        time = until
        for _ in range(ATTEMPTS):
            gap = self.tip_motion("Position")[1] + self.scene.surface.height
            if gap <= LOCATED_M:
                return time
            ahead = -gap / self.tip_motion("Velocity")[1]
            steps = max(1, math.ceil(ahead / (flight_step if located else contact_step)))
            if not located:
                ahead = steps * contact_step
            self.advance(time, ahead, steps)
            time += ahead
        raise PeerFailedError("Exudyn's contact was not found")


def tap(
    scene: "hcm.Scene", flight_step: float, contact_step: float, located: bool, until: float,
    adaptive: bool = False, window: float = CONTACT_WINDOW_S, spectral_radius: float = 0.8,
    jacobian_a_step: bool = False,
) -> PeerTap:  # fmt: skip
    """Fall from rest and tap.

    scene : undriven, from rest, sliding in +X; its settings and assumptions for hcm are not used.
    flight_step, contact_step : s.
    located : see the module.
    until : s, a time shortly before contact.
    adaptive : whether Exudyn may shorten a step that fails.
    window : s, time after contact that is solved, again and again until the tap has ended, at most
        `WINDOWS` times.
    spectral_radius : of Exudyn's generalized-alpha method.
    jacobian_a_step : make a new Jacobian in every step, instead of keeping one while it converges.

    Raises PeerFailedError: Exudyn stopped, the tip sticks or turns back, or the tap does not end.
    """
    finger = _Finger(scene, adaptive, spectral_radius, jacobian_a_step)
    contact = finger.fly(flight_step, contact_step, located, until)
    velocity = finger.tip_motion("Velocity")
    finger.touch()
    steps, rows = round(window / contact_step), np.empty((0, 4))
    for number in range(WINDOWS):
        finger.advance(contact + number * steps * contact_step, steps * contact_step, steps)
        # those of the contact: its start once, though every call stores its own
        latest = finger.system.GetSensorStoredData(finger.sensor)[-(steps + (number == 0)) :]
        rows = np.concatenate([rows, latest])
        force = -scene.tip.k * (rows[:, 2] + scene.surface.height)
        if _falls(force).size:
            break
    time = rows[:, 0] - contact
    quantities = _quantities(contact, time, force, located)
    tap_rows = time <= quantities.duration_s  # beyond it the linear terms pull the tip back
    stretched = scene.surface.friction * force / scene.tip.k  # eta^2 times it
    particle = scene.tip.tangential_ratio * rows[:, 1] - stretched  # X_P over eta^2
    if (np.diff(particle[tap_rows]) <= 0.0).any():
        raise PeerFailedError(
            f"surface.friction = {scene.surface.friction:g}: the tip sticks or turns back while it"
            " touches, where this peer has it slide in +X; use --model hcm"
        )
    ends = contact - contact_step, contact + quantities.duration_s
    return PeerTap(
        quantities,
        finger.steps,
        np.concatenate([ends[:1], rows[tap_rows, 0], ends[1:]]),
        np.concatenate([[0.0], np.maximum(force[tap_rows], 0.0), [0.0]]),
        velocity,
    )


def _falls(force: Any) -> Any:
    """Rows after which F_n falls through zero; the tap ends at the first."""
    return np.flatnonzero((force[1:] <= 0) & (force[:-1] > 0))


def _quantities(contact: float, time: Any, force: Any, located: bool) -> TapQuantities:
    """Peak by a parabola, separation where F_n falls through zero (unlocated: the step after)."""
    falls = _falls(force)
    if not falls.size:
        raise PeerFailedError(f"Exudyn's contact does not end within {1e3 * time[-1]:.3g} ms")
    last = int(falls[0])
    top = max(int(np.argmax(force[: last + 1])), 1)
    step = time[top + 1] - time[top]
    second, first, peak = np.polyfit((time[top - 1 : top + 2] - time[top]) / step,
                                     force[top - 1 : top + 2], 2)  # fmt: skip
    share = force[last] / (force[last] - force[last + 1]) if located else 1.0
    duration = time[last] + share * (time[last + 1] - time[last])
    impulse = np.trapezoid([*force[: last + 1], 0.0], [*time[: last + 1], duration])
    return TapQuantities(
        contact_time_s=contact,
        turn_s=float(time[top] - 0.5 * first / second * step),
        duration_s=float(duration),
        peak_normal_force_N=float(peak - 0.25 * first**2 / second),
        normal_impulse_N_s=float(impulse),
    )

"""Reduced model of a soft finger that taps a rough surface (Yang and Shen 2019).

Planar ANCF beams, hinges by Lagrange multipliers, a lumped-parameter contact with located
compression-restitution and stick-slip events; generalized-alpha or Gauss collocation in time, in
flight and in contact.
"""

from hcm.accuracy.chosen import SMALLEST, Chosen, settings_for
from hcm.accuracy.simulate_within import simulate_within
from hcm.assumptions import Assumptions
from hcm.batch import Outcome, simulate_each, simulate_many
from hcm.model import RigidStart, Scene
from hcm.parameters import (
    Drive,
    Finger,
    ParameterError,
    Phalanx,
    Settings,
    Surface,
    Tip,
    TorqueTable,
)
from hcm.results.posture import Posture
from hcm.results.result import Accuracy, Choice, Event, History, Statistics, Summary, TapResult
from hcm.results.status import Status
from hcm.simulate import simulate, simulate_scene
from hcm.vary import vary

__all__ = [
    "SMALLEST",
    "Accuracy",
    "Assumptions",
    "Choice",
    "Chosen",
    "Drive",
    "Event",
    "Finger",
    "History",
    "Outcome",
    "ParameterError",
    "Phalanx",
    "Posture",
    "RigidStart",
    "Scene",
    "Settings",
    "Statistics",
    "Status",
    "Summary",
    "Surface",
    "TapResult",
    "Tip",
    "TorqueTable",
    "settings_for",
    "simulate",
    "simulate_each",
    "simulate_many",
    "simulate_scene",
    "simulate_within",
    "vary",
]

"""The bar in Kratos Multiphysics (BSD-4): SmallDisplacementElement3D8N, central differences."""

import importlib
from typing import Any

from validation.peers.bar import DENSITY, STEP_S, YOUNG, Bar, seconds_per_step

ELEMENT = "SmallDisplacementElement3D8N"


def run_bar(bar: Bar) -> tuple[float, float]:
    """Seconds per step and `BarRun.end_m`, with the strategy of Kratos's own explicit solver."""
    kratos: Any = importlib.import_module("KratosMultiphysics")
    solids: Any = importlib.import_module("KratosMultiphysics.StructuralMechanicsApplication")
    kratos.ParallelUtilities.SetNumThreads(bar.threads)
    points, cells = bar.mesh()
    model = kratos.Model()
    part = model.CreateModelPart("bar")
    nodal = (kratos.DISPLACEMENT, kratos.VELOCITY, kratos.ACCELERATION, kratos.REACTION,
             kratos.FORCE_RESIDUAL, kratos.RESIDUAL_VECTOR, kratos.NODAL_MASS,
             kratos.VOLUME_ACCELERATION, solids.MIDDLE_VELOCITY)  # fmt: skip
    for variable in nodal:
        part.AddNodalSolutionStepVariable(variable)
    part.SetBufferSize(2)
    info = part.ProcessInfo
    info[kratos.DOMAIN_SIZE] = 3
    info[kratos.COMPUTE_LUMPED_MASS_MATRIX] = True
    info[solids.RAYLEIGH_ALPHA] = info[solids.RAYLEIGH_BETA] = 0.0
    properties = part.GetProperties()[1]
    properties[kratos.YOUNG_MODULUS], properties[kratos.POISSON_RATIO] = YOUNG, 0.0
    properties[kratos.DENSITY] = DENSITY
    properties[kratos.CONSTITUTIVE_LAW] = solids.LinearElastic3DLaw()
    freedoms = (kratos.DISPLACEMENT_X, kratos.DISPLACEMENT_Y, kratos.DISPLACEMENT_Z)
    velocity = bar.velocity(points)
    for number, place in enumerate(points.tolist()):
        node = part.CreateNewNode(number + 1, *place)
        for freedom in freedoms:
            node.AddDof(freedom)
        node.SetSolutionStepValue(kratos.VELOCITY_X, 0, float(velocity[number, 0]))
    for number, nodes in enumerate((cells + 1).tolist()):
        part.CreateNewElement(ELEMENT, number + 1, nodes, properties)
    scheme = solids.ExplicitCentralDifferencesScheme(1.0, 0.0, 0.0)
    strategy = solids.MechanicalExplicitStrategy(part, scheme, False, False, False)
    strategy.SetEchoLevel(0)
    strategy.SetRebuildLevel(0)
    strategy.Initialize()
    info[kratos.DELTA_TIME] = STEP_S
    taken = 0

    def step() -> None:
        nonlocal taken
        taken += 1
        part.CloneTimeStep(taken * STEP_S)
        info[kratos.STEP] = taken
        strategy.InitializeSolutionStep()
        strategy.SolveSolutionStep()
        strategy.FinalizeSolutionStep()

    seconds = seconds_per_step(step, bar.steps)
    ends = [node.GetSolutionStepValue(kratos.DISPLACEMENT_X) for node in part.Nodes
            if node.X0 == 0.0]  # fmt: skip
    return seconds, sum(ends) / len(ends)

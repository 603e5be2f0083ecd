"""Choose a step's integrator: the one that the run was set up with for the contact's mode.

An `Integrator` takes all steps by generalized-alpha; a `GaussIntegrator` takes those in flight, in
contact or both by Gauss collocation (its fields `flight`, `contact`). The choice is made by type,
while the loop is compiled: runs without collocation neither compile it nor pass its arrays.
"""

from hcm.assembly.state import Motion
from hcm.compiled import by_type, kernel
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators import gauss, generalized_alpha
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.workspace import Coefficients, Integrator

AnyIntegrator = Integrator | GaussIntegrator


@kernel
def collocated(contact: ContactState, integrator: GaussIntegrator) -> bool:
    """Whether collocation takes the steps in the contact's mode."""
    return integrator.flight if contact.normal_mode == FLIGHT else integrator.contact


@kernel
def plain(of: GaussIntegrator) -> Integrator:
    """The part for generalized-alpha, which takes the steps in the other modes."""
    return Integrator(of.co, of.chain, of.law, of.work)


@kernel
def step_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> bool:
    """Advance `old` by h into `new`, the contact staying in its mode; return if it converged."""
    if collocated(contact, integrator):
        return gauss.step(h, contact, old, new, integrator)
    return generalized_alpha.step(h, contact, old, new, plain(integrator))


@kernel
def error_by_alpha(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: Integrator
) -> tuple[float, float]:
    """The latest step's estimated error in q, m, and the power of h that it is proportional to."""
    return generalized_alpha.local_error(h, old, new, integrator), 3.0


@kernel
def error_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> tuple[float, float]:
    """`error_by_alpha`, or collocation's error if it took the step."""
    if collocated(contact, integrator):
        return gauss.local_error(h, integrator), integrator.tableau.c.size + 1.0
    return error_by_alpha(h, contact, old, new, plain(integrator))


@kernel
def loss_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> float:
    """Energy lost to the material and a radiating tip in the latest step, J."""
    if collocated(contact, integrator):
        return gauss.material_loss(h, contact, integrator)
    return generalized_alpha.material_loss(h, contact, old, new, plain(integrator))


@kernel
def alpha_with(co: Coefficients, of: Integrator) -> Integrator:
    """The integrator with other coefficients of generalized-alpha."""
    return Integrator(co, *of[1:])


@kernel
def gauss_with(co: Coefficients, of: GaussIntegrator) -> GaussIntegrator:
    """`alpha_with` for an integrator with collocation."""
    return GaussIntegrator(co, *of[1:])


take_step = by_type(GaussIntegrator, step_by_mode, generalized_alpha.step)
error_of_step = by_type(GaussIntegrator, error_by_mode, error_by_alpha)
loss_of_step = by_type(GaussIntegrator, loss_by_mode, generalized_alpha.material_loss)
with_coefficients = by_type(GaussIntegrator, gauss_with, alpha_with)

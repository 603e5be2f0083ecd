"""Which integrator takes a step: the one for the contact's mode that the run was set up with.

An `Integrator` takes all steps by generalized-alpha; a `GaussIntegrator` takes those in flight, in
contact or both by Gauss collocation (its fields `flight`, `contact`). The choice is made by type,
while the loop is compiled: runs without collocation neither compile it nor pass its arrays.
"""

from hcm.compiled import by_type, kernel
from hcm.contact.law import FLIGHT, ContactState
from hcm.integrators import gauss, generalized_alpha
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.workspace import Coefficients, Integrator
from hcm.state import Motion

AnyIntegrator = Integrator | GaussIntegrator


@kernel
def collocated(contact: ContactState, integrator: GaussIntegrator) -> bool:
    """Whether the contact's mode is one of collocation's."""
    return integrator.flight if contact.normal_mode == FLIGHT else integrator.contact


@kernel
def plain(of: GaussIntegrator) -> Integrator:
    """The integrator of the other modes."""
    return Integrator(of.co, of.chain, of.law, of.work)


@kernel
def step_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> bool:
    """Advance `old` by h into `new`, the contact staying in its mode; whether that converged."""
    if collocated(contact, integrator):
        return gauss.step(h, contact, old, new, integrator)
    return generalized_alpha.step(h, contact, old, new, plain(integrator))


@kernel
def error_by_alpha(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: Integrator
) -> tuple[float, float]:
    """The latest step's estimated error in q, m, and the power of h that it goes with."""
    return generalized_alpha.local_error(h, old, new, integrator), 3.0


@kernel
def error_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> tuple[float, float]:
    """The same."""
    if collocated(contact, integrator):
        return gauss.local_error(h, integrator), integrator.tableau.c.size + 1.0
    return error_by_alpha(h, contact, old, new, plain(integrator))


@kernel
def loss_by_mode(
    h: float, contact: ContactState, old: Motion, new: Motion, integrator: GaussIntegrator
) -> float:
    """What the material has dissipated in the latest step, J."""
    if collocated(contact, integrator):
        return gauss.material_loss(h, contact, integrator)
    return generalized_alpha.material_loss(h, contact, old, new, plain(integrator))


@kernel
def alpha_with(co: Coefficients, of: Integrator) -> Integrator:
    """The integrator with other coefficients of generalized-alpha."""
    return Integrator(co, of.chain, of.law, of.work)


@kernel
def gauss_with(co: Coefficients, of: GaussIntegrator) -> GaussIntegrator:
    """The same."""
    return GaussIntegrator(
        co, of.chain, of.law, of.work, of.tableau, of.gauss, of.flight, of.contact
    )


take_step = by_type(GaussIntegrator, step_by_mode, generalized_alpha.step)
error_of_step = by_type(GaussIntegrator, error_by_mode, error_by_alpha)
loss_of_step = by_type(GaussIntegrator, loss_by_mode, generalized_alpha.material_loss)
with_coefficients = by_type(GaussIntegrator, gauss_with, alpha_with)

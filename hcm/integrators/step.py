"""Which integrator takes a step: the one for the contact's mode that the run was set up with.

An `Integrator` takes all steps by generalized-alpha; a `GaussIntegrator` takes those in flight by
Gauss collocation. The choice is made by the type, while the loop is compiled: a run that does not
use collocation neither compiles it nor hands its arrays around.
"""

from collections.abc import Callable
from typing import Any

from numba.extending import overload

from hcm.contact.law import FLIGHT, Contact
from hcm.integrators import gauss, generalized_alpha
from hcm.integrators.gauss_tableau import GaussIntegrator
from hcm.integrators.workspace import Coefficients, Integrator
from hcm.state import Motion

AnyIntegrator = Integrator | GaussIntegrator


def take_step(
    h: float, contact: Contact, old: Motion, new: Motion, integrator: AnyIntegrator
) -> bool:
    """Advance `old` by h into `new`, the contact staying in its mode; whether that converged.

    For compiled callers only, as are the others here.
    """
    raise NotImplementedError


def with_coefficients(co: Coefficients, of: AnyIntegrator) -> AnyIntegrator:
    """The integrator with other coefficients of generalized-alpha."""
    raise NotImplementedError


def error_of_step(
    h: float, contact: Contact, old: Motion, new: Motion, integrator: AnyIntegrator
) -> tuple[float, float]:
    """The latest step's estimated error in q, m, and the power of h that it goes with."""
    raise NotImplementedError


def loss_of_step(
    h: float, contact: Contact, old: Motion, new: Motion, integrator: AnyIntegrator
) -> float:
    """What the material has dissipated in the latest step, J."""
    raise NotImplementedError


def _with_collocation(integrator: Any) -> bool:
    return getattr(integrator, "instance_class", None) is GaussIntegrator


@overload(take_step, inline="always")
def _take_step(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> Callable[..., bool]:
    plain, collocation = generalized_alpha.step, gauss.step

    def by_generalized_alpha(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> bool:
        return plain(h, contact, old, new, integrator)

    def by_mode(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> bool:
        if integrator.flight if contact.normal == FLIGHT else integrator.contact:
            return collocation(h, contact, old, new, integrator)
        parts = Integrator(integrator.co, integrator.chain, integrator.law, integrator.work)
        return plain(h, contact, old, new, parts)

    return by_mode if _with_collocation(integrator) else by_generalized_alpha


@overload(with_coefficients)
def _with_coefficients(co: Any, of: Any) -> Callable[..., Any]:
    def plain(co: Any, of: Any) -> Any:
        return Integrator(co, of.chain, of.law, of.work)

    def collocation(co: Any, of: Any) -> Any:
        return GaussIntegrator(
            co, of.chain, of.law, of.work, of.tableau, of.gauss, of.flight, of.contact
        )

    return collocation if _with_collocation(of) else plain


@overload(error_of_step, inline="always")
def _error_of_step(
    h: Any, contact: Any, old: Any, new: Any, integrator: Any
) -> Callable[..., tuple[float, float]]:
    plain, collocation = generalized_alpha.local_error, gauss.local_error

    def by_generalized_alpha(
        h: Any, contact: Any, old: Any, new: Any, integrator: Any
    ) -> tuple[float, float]:
        return plain(h, old, new, integrator), 3.0

    def by_mode(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> tuple[float, float]:
        if integrator.flight if contact.normal == FLIGHT else integrator.contact:
            return collocation(h, integrator), integrator.tableau.c.size + 1.0
        parts = Integrator(integrator.co, integrator.chain, integrator.law, integrator.work)
        return plain(h, old, new, parts), 3.0

    return by_mode if _with_collocation(integrator) else by_generalized_alpha


@overload(loss_of_step)
def _loss_of_step(
    h: Any, contact: Any, old: Any, new: Any, integrator: Any
) -> Callable[..., float]:
    plain, collocation = generalized_alpha.material_loss, gauss.material_loss

    def by_generalized_alpha(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> float:
        return plain(h, contact, old, new, integrator)

    def by_mode(h: Any, contact: Any, old: Any, new: Any, integrator: Any) -> float:
        if integrator.flight if contact.normal == FLIGHT else integrator.contact:
            return collocation(h, contact, integrator)
        parts = Integrator(integrator.co, integrator.chain, integrator.law, integrator.work)
        return plain(h, contact, old, new, parts)

    return by_mode if _with_collocation(integrator) else by_generalized_alpha

"""All stability maps, whichever solver they are about."""

from __future__ import annotations

from validation.studies.stress.frame import Map
from validation.studies.stress.maps import hcm_maps
from validation.studies.stress.reference_maps import reference_maps


def all_maps(quick: bool) -> tuple[Map, ...]:
    """Every map of ``fingertap stress``; `quick` takes the axes coarser."""
    return (*hcm_maps(quick), *reference_maps(quick))

"""All stability maps, whichever solver they are about."""

from __future__ import annotations

from validation.studies.stress.hcm.maps import hcm_maps
from validation.studies.stress.reference.maps import reference_maps
from validation.studies.stress.stability_map import Map


def all_maps(quick: bool) -> tuple[Map, ...]:
    """Every map of ``fingertap stress``; `quick` takes the axes coarser."""
    return (*hcm_maps(quick), *reference_maps(quick))

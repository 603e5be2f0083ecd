"""Ten of the hardest cells, and what a solver of one's own is measured with on them.

Seven are frictionless with e* = 1, so that their contact is a one-sided linear spring, which any
solver can express; three have friction, loops or torques.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import hcm
from validation.harness.interrupts import unless_interrupted
from validation.studies.random_scenes import HcmScene
from validation.studies.stress.hcm.judge import tap_scalars, tighter

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=5)


@dataclass(frozen=True)
class HardCell:
    """Why a cell is hard, its scene, and whether its contact is a frictionless linear spring."""

    name: str
    scene: HcmScene
    linear: bool


def _scene(
    phalanx: hcm.Phalanx = SOFT, count: int = 3, height: float = 0.1, friction: float = 0.0,
    tip: hcm.Tip = hcm.Tip(0.78e6), drive: hcm.Drive = hcm.Drive(),  # noqa: B008  frozen
) -> HcmScene:  # fmt: skip
    return HcmScene(
        hcm.Finger((phalanx,) * count), hcm.Surface(height, friction), tip, drive,
        hcm.Settings(max_steps=100_000),
    )  # fmt: skip


def hard_cells() -> tuple[HardCell, ...]:
    """The cells, those that every solver can express first."""

    def plain(name: str, scene: HcmScene) -> HardCell:
        return HardCell(name, scene, linear=True)

    slender = hcm.Phalanx(0.04, 0.0004, 1e9, 1400.0, elements=20)
    return (
        plain("stiffest beams, E 1e12 Pa", _scene(replace(SOFT, youngs_modulus=1e12))),
        plain("softest beams, E 1e6 Pa", _scene(replace(SOFT, youngs_modulus=1e6))),
        plain("stiffest tip, k 1e10 N/m", _scene(tip=hcm.Tip(1e10))),
        plain("softest tip, k 1e3 N/m", _scene(tip=hcm.Tip(1e3))),
        plain("slenderness 100, 20 elements", _scene(slender)),
        plain("80 elements a phalanx", _scene(replace(SOFT, elements=80))),
        plain("30 phalanges", _scene(replace(SOFT, elements=2), 30, 0.96)),
        HardCell("friction 10, tangential ratio 1e3",
                 _scene(friction=10.0, tip=hcm.Tip(0.78e6, 1.0, 1e3)), linear=False),
        HardCell("e* 0.05, friction 5.3: a tap that barely ends",
                 _scene(friction=5.337, tip=hcm.Tip(0.78e6, 0.05, 284.8)), linear=False),
        HardCell("torques that wind the finger up",
                 _scene(friction=0.5, drive=hcm.Drive((0.00631,) * 3, 1.233)), linear=False),
    )  # fmt: skip


@dataclass(frozen=True)
class Tap:
    """First tap's peak F_n (N) and impulse (N s)."""

    peak_normal_force_N: float
    normal_impulse_N_s: float

    def error(self, truth: Tap) -> float:
        """Largest relative difference."""
        return max(
            abs(self.peak_normal_force_N / truth.peak_normal_force_N - 1),
            abs(self.normal_impulse_N_s / truth.normal_impulse_N_s - 1),
        )


def tap_of(result: hcm.TapResult) -> Tap | None:
    """The tap of a run of hcm, None if it has none."""
    scalars = tap_scalars(result)
    return None if scalars is None else Tap(scalars[0], scalars[1])


def truth_of(cell: HardCell) -> Tap | None:
    """Hcm with tolerances a hundred times smaller and steps a fifth as long."""
    settings = tighter(cell.scene.settings, 5.0, 100.0)
    return tap_of(
        unless_interrupted(hcm.simulate(**replace(cell.scene, settings=settings).arguments()))
    )

"""A short tap of one phalanx, for the tests of judges, checks and campaigns."""

import hcm

SOFT = hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements=2)
TAP = hcm.Scene(
    hcm.Finger((SOFT,)), hcm.Surface(0.03, 0.5), hcm.Tip(0.78e6, 0.8), hcm.Drive(),
    hcm.Settings(max_steps=5_000),
)  # fmt: skip

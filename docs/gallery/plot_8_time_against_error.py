"""
Time against error of your own settings
=======================================

What does a shorter step buy? The soft tap is solved with fixed contact steps and 2 or 20 elements a
phalanx, and compared with a far tighter run: the error falls with the step's square down to what
the elements leave. `fingertap bench` does this for both models and every setting. Flights are
rigid, so that time goes to the contact; times are the shortest of three runs.
"""

from matplotlib import pyplot as plt

import hcm

SURFACE, TIP = hcm.Surface(height=0.1, friction=0.5), hcm.Tip(normal_stiffness=0.78e6)


def tap(elements, **settings):
    """Peak force (N) and solve time (s) with these elements and hcm settings."""
    finger = hcm.Finger((hcm.Phalanx(0.04, 0.015, 1e9, 1400.0, elements),) * 3)
    chosen = hcm.Settings(estimate=False, flight="rigid", contact_tolerance=0.0, **settings)
    runs = [hcm.simulate(finger, SURFACE, TIP, hcm.Drive(), chosen) for _ in range(3)]
    seconds = min(run.statistics.wall_time_s for run in runs)
    return runs[0].summary.peak_normal_force_N, seconds


truth, _ = tap(20, contact_step=1e-7)
print(f"truth {truth:.4f} N")

figure, axis = plt.subplots(figsize=(6, 3.8), layout="constrained")
for elements, style in ((2, "o-"), (20, "s-")):
    errors, times = [], []
    for step in (2e-5, 1e-5, 5e-6, 2e-6, 1e-6):
        peak, seconds = tap(elements, contact_step=step)
        errors.append(abs(peak / truth - 1))
        times.append(1e3 * seconds)
    axis.loglog(errors, times, style, label=f"{elements} elements a phalanx")
axis.set(xlabel="error of the peak force, relative", ylabel="time of the solve (ms)")
axis.legend()
plt.show()

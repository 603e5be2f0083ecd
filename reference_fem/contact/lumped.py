"""The lumped contact law for a solid: bilinear normal element, stick or slip.

The same law as the reduced model's (paper, section 2.2.2), written independently as a return
mapping that is evaluated once per explicit step, without located events. It acts on one point C of
the solid (see `lumped_law`), at x_C with the gap g:

- normal: ΔF_n = -k_n Δg, k_n = k while g falls and k/e*² while it rises; contact begins at the gap
  g_0 (zero, or the residual deformation of an earlier loop until the face has left the surface)
  and ends at F_n = 0;
- tangential: F_t = -k_t (x_C - a), k_t = k η⁻², |F_t| <= μ F_n, the anchor a sliding on the cone
  (see `friction`). While slipping a moves with V_P = V_t - d/dt(-F_t/k_t): the anchor is the
  paper's massless particle P.
"""

from reference_fem.arrays import Array
from reference_fem.compiled import inner
from reference_fem.contact.friction import return_map, slip_loss

# Places in the law's memory and, after it, of the point's rotation at the last evaluation, ...
TOUCHING, FORCE, GAP, START_GAP, ANCHOR, TANGENTIAL = range(6)
MEMORY = TURN = 6
# ... and of the energies that one evaluation reports: stored now, and lost in this step.
STORED, FRICTION_LOSS, HYSTERESIS_LOSS = range(3)
ENERGIES = 3


@inner()
def lumped_force(
    x: float,
    gap: float,
    speed_x: float,
    speed_y: float,
    stiffness: float,
    restitution: float,
    tangential_ratio: float,
    hertz_force: float,
    friction: float,
    memory: Array,
    energies: Array,
) -> tuple[float, float]:
    """(F_t, F_n) on the tip, N; commits the law's memory.

    Losses come from the law itself, not from the work of the forces: friction by `slip_loss`,
    hysteresis ½(1 - e*²)(F'² - F²)/k while compressing; what both elements can give
    back is F_n² e*²/2k + F_t²/2k_t.

    x, gap : m. memory : (MEMORY,), changed in place; TOUCHING is 0 or 1.
    speed_x, speed_y : of the half step that led here, m/s: they place the crossing inside the step.
    energies : (ENERGIES,), filled.
    """
    energies[:] = 0.0
    if memory[TOUCHING] == 0.0:
        if gap > 0.0:
            memory[START_GAP] = 0.0
        if gap >= memory[START_GAP] or speed_y >= 0.0:
            return 0.0, 0.0
        since = (gap - memory[START_GAP]) / speed_y
        memory[TOUCHING] = 1.0
        memory[FORCE] = memory[TANGENTIAL] = 0.0
        memory[GAP] = memory[START_GAP]
        memory[ANCHOR] = x - since * speed_x
    before, closing = memory[FORCE], memory[GAP] - gap
    share = restitution * restitution
    slope = stiffness if closing > 0.0 else stiffness / share
    normal = before + slope * closing
    if hertz_force > 0.0:
        depth = max(0.0, -gap)
        normal = hertz_force * (0.8 * stiffness * depth / hertz_force) ** 1.5
    k_t = stiffness * tangential_ratio
    if normal <= 0.0:
        # what is left in the tangential element: its anchor slips
        energies[FRICTION_LOSS] = 0.5 * memory[TANGENTIAL] ** 2 / k_t if k_t > 0.0 else 0.0
        memory[FORCE] = memory[TANGENTIAL] = 0.0
        # Where the branch reached zero, inside the step.
        memory[START_GAP] = 0.0 if hertz_force > 0.0 else min(0.0, memory[GAP] + before / slope)
        memory[TOUCHING] = 0.0
        return 0.0, 0.0
    tangential = 0.0
    if friction > 0.0 and k_t > 0.0:
        tangential, _, slip, _ = return_map(k_t, x - memory[ANCHOR], 0.0, friction * normal)
        memory[ANCHOR] += slip
        energies[FRICTION_LOSS] = slip_loss(memory[TANGENTIAL], 0.0, tangential, 0.0, slip, 0.0)
        energies[STORED] = 0.5 * tangential * tangential / k_t
    if closing > 0.0:
        energies[HYSTERESIS_LOSS] = 0.5 * (1.0 - share) * (normal**2 - before**2) / stiffness
    if hertz_force > 0.0:
        energies[STORED] += 0.4 * normal * max(0.0, -gap)
    else:
        energies[STORED] += 0.5 * normal * normal * share / stiffness
    memory[FORCE], memory[GAP], memory[TANGENTIAL] = normal, gap, tangential
    return tangential, normal

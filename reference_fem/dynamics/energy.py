"""Energy audit of one state: every term from its own source, none from the sum of forces."""

import numpy as np

from reference_fem.arrays import Array
from reference_fem.compiled import njit
from reference_fem.contact import law
from reference_fem.dynamics.next_touch import next_touch_s
from reference_fem.dynamics.state import State
from reference_fem.dynamics.step import Block
from reference_fem.model import Model
from reference_fem.results.result import Sample


def sample(model: Model, state: State, block: Block, origin_energy_J: float) -> Sample:
    """Audit `state`, from which `block` started.

    - kinetic: ½ Σ m v², v the mean of the two half-step velocities around t_n
    - strain: the elements' own, from strains; hourglass: the part held by hourglass control
    - gravity: -Σ m f·u, f the acceleration of gravity
    - contact: springs' energy from gaps and offsets; dissipation from slip increments; damping
      from the dashpots' forces and speeds
    - material: its damping, from strain rates between the states
    - drive work: Σ T_w θ_w - ∫ θ_w dT_w, θ_w the rotation of the driven face

    balance = kinetic + strain + gravity + contact + dissipation + damping + material - drive work
    - origin,
    the origin being the same sum where the motion started (zero for a finger at rest).
    """
    factor = model.symmetry_factor
    u, v, row = state.displacement, block.velocity, block.log[0] * factor
    with np.errstate(all="ignore"):
        kinetic, moment_x, moment_y = _kinetic_and_moments(u, v, model.mass)
        kinetic *= factor
        strain, hourglass = factor * block.stored_J, factor * block.hourglass_J
        fx, fy = model.gravity_vector
        gravity = -(fy * moment_y + fx * moment_x) * factor
        work = model.couples.work(model.torques.at(state.time_s), state.face_angles)
        work = (work - state.torque_change_work_J) * factor
        columns = law.SPRING_ENERGY, law.DISSIPATION, law.DAMPING
        springs, friction, damping = (float(row[column]) for column in columns)
        material = factor * block.material_J
        stored = kinetic + strain + gravity + springs + friction + damping + material
        stress = model.probe.read(model.kernel, u, v)
        touch_in_s = next_touch_s(model, u, v)
    return Sample(
        time_s=state.time_s,
        normal_force_N=float(row[law.NORMAL]),
        tangential_force_N=float(row[law.TANGENTIAL]),
        tip_position_m=model.points[model.pole, :2] + u[model.pole, :2],
        tip_velocity_m_per_s=v[model.pole, :2].copy(),
        stress_R_Pa=stress,
        kinetic_energy_J=kinetic,
        strain_energy_J=strain,
        hourglass_energy_J=hourglass,
        gravity_energy_J=gravity,
        contact_energy_J=springs,
        friction_dissipation_J=friction,
        contact_damping_J=damping,
        material_dissipation_J=material,
        drive_work_J=work,
        energy_balance_J=stored - work - origin_energy_J,
        coulomb_excess_N=float(block.log[0, law.EXCESS]),  # of one site, in half a model too
        contact_area_m2=float(row[law.AREA]),
        peak_pressure_Pa=float(block.pressure.max()),
        hinge_reactions_N=block.reactions * factor,
        next_touch_s=touch_in_s,
    )


@njit(cache=True)
def _kinetic_and_moments(
    displacement: Array, velocity: Array, mass: Array
) -> tuple[float, float, float]:
    """½ Σ m_i |v_i|², Σ m_i u_xi and Σ m_i u_yi.

    One thread does it all: up to some 30,000 nodes that takes no longer than waking others.
    """
    kinetic = 0.0
    moment_x, moment_y = 0.0, 0.0
    n_points, dim = velocity.shape
    for i in range(n_points):
        square = 0.0
        for d in range(dim):
            square += velocity[i, d] * velocity[i, d]
        kinetic += 0.5 * mass[i] * square
        moment_x += mass[i] * displacement[i, 0]
        moment_y += mass[i] * displacement[i, 1]
    return kinetic, moment_x, moment_y

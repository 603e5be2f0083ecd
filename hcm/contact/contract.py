"""The interface of a contact for the integrators and the record, whatever its law.

Each name is the kernel of that name in `law` and `point` (the paper's contact) for a `ContactLaw`,
in a round tip's modules for a `RoundTipLaw`: chosen by the law's type while its caller is compiled.
The paper's contact acts at a node and remembers no more than its `ContactState`: no force depends
on v, and it has nothing to commit.
"""

from hcm.compiled import by_type
from hcm.contact import (
    law,
    point,
    round_tip,
    round_tip_kinematics,
    round_tip_law,
    tip_compliance,
    tip_damping,
)
from hcm.contact.law import ContactLaw
from hcm.contact.round_tip import RoundTipLaw

Law = ContactLaw | RoundTipLaw

sticks_first = by_type(RoundTipLaw, round_tip_law.sticks_first, law.sticks_first)
contact_force = by_type(RoundTipLaw, round_tip_law.contact_force, law.contact_force)
normal_slope = by_type(RoundTipLaw, round_tip_law.normal_slope, law.normal_slope)
particle_position = by_type(RoundTipLaw, round_tip_law.particle_position, law.particle_position)
particle_velocity = by_type(RoundTipLaw, round_tip_law.particle_velocity, law.particle_velocity)
margins = by_type(RoundTipLaw, round_tip_law.margins, law.margins)
margin_rates = by_type(RoundTipLaw, round_tip_law.margin_rates, law.margin_rates)
friction_loss = by_type(RoundTipLaw, round_tip_law.friction_loss, law.friction_loss)
stored_energy = by_type(RoundTipLaw, round_tip_law.stored_energy, law.stored_energy)
hysteresis_loss = by_type(RoundTipLaw, round_tip_law.hysteresis_loss, law.hysteresis_loss)
shear_history = by_type(RoundTipLaw, tip_compliance.shear_history, (0.0, 0.0))
shear_work = by_type(RoundTipLaw, tip_compliance.shear_work, 0.0)
strain_share = by_type(RoundTipLaw, round_tip.strain_share, 1.0)
contact_position = by_type(RoundTipLaw, tip_compliance.contact_position, point.contact_position)
contact_velocity = by_type(RoundTipLaw, tip_compliance.contact_velocity, point.contact_velocity)
axis_end = by_type(RoundTipLaw, round_tip_kinematics.axis_end, point.axis_end)
tip_force = by_type(RoundTipLaw, tip_damping.tip_force, point.tip_force)
has_rate_force = by_type(RoundTipLaw, tip_damping.has_rate_force, False)
rate_force = by_type(RoundTipLaw, tip_damping.rate_force, (0.0, 0.0))
rate_power = by_type(RoundTipLaw, tip_damping.rate_power, 0.0)
unrecovered_energy = by_type(RoundTipLaw, tip_damping.unrecovered_energy, 0.0)
subtract_force = by_type(RoundTipLaw, round_tip_kinematics.subtract_force, point.subtract_force)
add_tangent = by_type(RoundTipLaw, round_tip_kinematics.add_tangent, point.add_tangent)
add_rate = by_type(RoundTipLaw, tip_damping.add_rate, None)
fill_column = by_type(RoundTipLaw, round_tip_kinematics.fill_column, point.fill_column)
stiffness_key = by_type(RoundTipLaw, round_tip_kinematics.stiffness_key, law.contact_tangent)
commit_history = by_type(RoundTipLaw, round_tip_kinematics.commit_history, None)
begin_mode = by_type(RoundTipLaw, round_tip_kinematics.begin_mode, None)

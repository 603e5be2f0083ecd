"""What the integrators and the record ask of a contact, whichever law it has.

Each name is the kernel of that name in `law` and `point` (the paper's contact) for a `ContactLaw`,
in `ball` and `round_tip` for a `BallLaw`: chosen by the law's type while its caller is compiled.
The paper's contact acts at a node and remembers no more than its `Contact`: it does not radiate
(no force depends on v), and has nothing to commit.
"""

from hcm.compiled import by_type
from hcm.contact import ball, law, point, round_tip
from hcm.contact.ball import BallLaw
from hcm.contact.law import ContactLaw

Law = ContactLaw | BallLaw

contact_force = by_type(BallLaw, ball.contact_force, law.contact_force)
normal_slope = by_type(BallLaw, ball.normal_slope, law.normal_slope)
particle_position = by_type(BallLaw, ball.particle_position, law.particle_position)
particle_velocity = by_type(BallLaw, ball.particle_velocity, law.particle_velocity)
margins = by_type(BallLaw, ball.margins, law.margins)
margin_rates = by_type(BallLaw, ball.margin_rates, law.margin_rates)
friction_loss = by_type(BallLaw, ball.friction_loss, law.friction_loss)
stored_energy = by_type(BallLaw, ball.stored_energy, law.stored_energy)
hysteresis_loss = by_type(BallLaw, ball.hysteresis_loss, law.hysteresis_loss)
place = by_type(BallLaw, round_tip.place, point.place)
velocity = by_type(BallLaw, round_tip.velocity, point.velocity)
axis_end = by_type(BallLaw, round_tip.axis_end, point.axis_end)
tip_force = by_type(BallLaw, round_tip.tip_force, point.tip_force)
radiates = by_type(BallLaw, round_tip.radiates, False)
radiated_force = by_type(BallLaw, round_tip.radiated_force, (0.0, 0.0))
radiated_power = by_type(BallLaw, round_tip.radiated_power, 0.0)
subtract_force = by_type(BallLaw, round_tip.subtract_force, point.subtract_force)
add_tangent = by_type(BallLaw, round_tip.add_tangent, point.add_tangent)
add_rate = by_type(BallLaw, round_tip.add_rate, None)
fill_column = by_type(BallLaw, round_tip.fill_column, point.fill_column)
stiffness_key = by_type(BallLaw, round_tip.stiffness_key, point.stiffness_key)
keep = by_type(BallLaw, round_tip.keep, None)
begin_mode = by_type(BallLaw, round_tip.begin_mode, None)

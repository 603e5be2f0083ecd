"""Time integrators of the beams and what they share: Newton, step size, event search."""

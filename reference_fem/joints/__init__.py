"""Hinges between phalanges, and sections that torques drive."""

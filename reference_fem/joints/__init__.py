"""Hinges between phalanges and the torques that drive them."""

"""Planar ANCF beams chained by hinges: element, chain, damping, torques, banded factors."""

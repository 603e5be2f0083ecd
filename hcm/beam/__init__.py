"""Planar ANCF beams chained by hinges: element, chain, equations of motion, their factors."""

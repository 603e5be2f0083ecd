"""Stability maps of the reference: scenes, judge, checks, CalculiX beside it."""

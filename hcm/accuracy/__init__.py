"""Solve to an accuracy: choose settings before a run, judge it after, solve again if need be."""

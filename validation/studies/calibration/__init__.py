"""Stated errors of random scenes against those that a tight solve finds."""

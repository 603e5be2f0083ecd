"""Stability maps of the reduced model: scenes, judges, checks, audit, peers."""

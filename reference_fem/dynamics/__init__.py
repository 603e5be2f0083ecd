"""The explicit loop: steps, state, record, energy audit, guards, restart files."""

"""Where the solvers break: random scenes, checks that don't trust the solver, stability maps."""

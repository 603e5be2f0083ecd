"""Studies of the models: the paper, assumptions, benchmarks, stated errors, evidence, stability."""

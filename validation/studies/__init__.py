"""Studies of the models: the paper regenerated, benchmarks, stability maps."""

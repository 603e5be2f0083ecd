"""Parameters that the reduced model needs, from the reference or from the paper's own results."""

"""The effect of each assumption of the reduced model, on a scene and over many."""

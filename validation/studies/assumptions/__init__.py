"""What each assumption of the reduced model is worth on a scene."""

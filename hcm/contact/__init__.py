"""The lumped contact of the fingertip: its law and the events that change its mode."""

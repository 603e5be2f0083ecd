"""Static solves of the meshed fingertip: compliance and indentation."""

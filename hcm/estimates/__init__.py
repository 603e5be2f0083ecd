"""What a run states of its errors: by a companion run, by other ends of its tap, by its steps."""

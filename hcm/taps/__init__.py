"""Which touches are one tap, when it ends, and the first tap's scalars."""

"""References from data: a file's curves, and notes of what was done to them."""

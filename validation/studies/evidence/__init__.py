"""Evidence from outside: published numbers and other programs beside ours, element to tap."""

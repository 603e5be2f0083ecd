"""One run of one model on one scene."""

"""Beams, hinges and contact together: equations of motion, their state, statics, coordinates."""

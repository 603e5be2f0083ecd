"""The first flight of a finger of rigid rods, to the moment of first contact, and its vibration."""

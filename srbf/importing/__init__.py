"""Photographs, or renders of other programs, as a capture: light lists, pairing of names, pictures."""

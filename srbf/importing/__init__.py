"""Import of photographs, or of renders by other programs, as a capture: light lists, pairing of names, image files."""

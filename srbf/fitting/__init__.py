"""From a capture to an asset: the method and its settings by name, by bytes per texel, or by decibels."""

"""From an asset and lights to an image: numpy and GL relighters, the direct light of an indirect asset, alpha."""

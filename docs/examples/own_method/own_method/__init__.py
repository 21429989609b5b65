"""Three methods of one's own, one of each kind: what docs/own-method.md shows."""

"""People in images, found by a network of its own: what the guard believes instead of the policy."""

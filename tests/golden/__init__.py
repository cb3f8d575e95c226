"""A handful of short flights whose logs stay the same, byte for byte, until somebody means to change them."""

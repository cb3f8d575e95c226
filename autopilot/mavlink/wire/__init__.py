"""The wire format: frames, fields, signatures, packed files, units."""

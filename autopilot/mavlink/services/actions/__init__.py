"""Commands that a client gives the vehicle."""

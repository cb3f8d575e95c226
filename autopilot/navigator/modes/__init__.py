"""The flight modes, one file each."""

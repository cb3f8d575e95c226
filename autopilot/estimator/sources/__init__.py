"""Sources of measurements: one file each, with its start, stop and reset rules."""

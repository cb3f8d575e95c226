"""Vehicle bodies: from motor commands, wind and world to the true state, 1,000 steps a second."""

"""What every layer shares: frames, rotations, geodesy, parameters, clock, random streams and log writers."""

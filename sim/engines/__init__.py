"""Engines: who moves the bodies. The native one is the multirotor of sim/bodies in Warp."""

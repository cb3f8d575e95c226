"""Engines: who moves the bodies. The native one is the bodies of sim/bodies in Warp."""

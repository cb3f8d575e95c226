"""'Park It Right': a car finds its spot among obstacles, on one storey (level 1) or over two with portals (level 2)."""

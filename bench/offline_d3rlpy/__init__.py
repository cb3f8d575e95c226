"""Our offline training beside d3rlpy's, on the same datasets."""

"""Training from recorded decisions, without a simulator: datasets on disk, algorithms on them, and what comes after."""

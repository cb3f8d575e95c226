"""Tasks, learning and trained policies."""

"""File transfer, logs, component metadata, and the shell."""

"""A scenario after its flight: judged by its checks."""

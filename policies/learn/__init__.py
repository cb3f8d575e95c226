"""Training of policies: the only folder that knows torch."""

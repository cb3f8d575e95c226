"""The second one in charge: it does not learn, and does not believe the policy."""

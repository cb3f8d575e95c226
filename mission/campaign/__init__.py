"""Campaigns: a scenario flown many times over distributions, until it is known how often it succeeds, and when not."""

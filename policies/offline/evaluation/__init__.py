"""Policies judged on recorded decisions, before they fly."""

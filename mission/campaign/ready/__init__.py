"""Campaigns that ship."""

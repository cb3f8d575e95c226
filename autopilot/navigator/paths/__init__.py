"""Paths that modes follow: circles, splines, straight legs, ways around the fence."""

"""Datasets for training without flying: built from what flights logged, or collected from the batch simulator."""

"""Airframe files, and for each class of vehicles the sections that its files have besides those of all."""

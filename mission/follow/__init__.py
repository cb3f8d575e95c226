"""Flights that follow somebody: the owner and their phone, the onboard camera, the companion computer."""

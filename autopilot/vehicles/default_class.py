"""The class of a vehicle whose airframe file names none, and of the dialects before they know their vehicle."""

from autopilot.vehicles.multirotor.vehicle import MULTIROTOR

DEFAULT_CLASS = MULTIROTOR

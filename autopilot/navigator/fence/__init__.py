"""The geofence and the rally points."""

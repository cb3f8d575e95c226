"""What tasks flown by the flight controller share."""

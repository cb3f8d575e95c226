"""What the vehicle is and what may be asked of it, for every part of the flight controller."""

"""Classes of vehicles: what flies or drives them, and what the flight controller must know of each."""

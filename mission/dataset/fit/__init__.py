"""`honeyguide dataset fit`: the simulator's numbers of an airframe from logs of its flights."""

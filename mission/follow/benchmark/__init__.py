"""`honeyguide benchmark follow`: any policy through the same flights, standard and outside of what it was trained for."""

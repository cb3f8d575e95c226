"""`honeyguide benchmark follow`: any policy through the same flights, standard and harder."""

"""How fast the vehicle moves, by its pictures: visual odometry of a companion."""

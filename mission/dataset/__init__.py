"""`honeyguide dataset`: datasets of flights and episodes, from which policies are trained without flying."""

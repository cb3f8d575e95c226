"""What is kept of a flight: recorder, flight log, summary, plots."""

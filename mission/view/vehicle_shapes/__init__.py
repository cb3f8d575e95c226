"""What vehicles look like."""

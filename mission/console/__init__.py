"""What commands print and refuse."""

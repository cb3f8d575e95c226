"""Where a companion goes that goes to goals."""

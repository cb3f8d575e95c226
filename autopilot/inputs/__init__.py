"""What comes from outside besides samples and commands: sticks, positions, obstacles, aircraft."""

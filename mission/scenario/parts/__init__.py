"""What a scenario is written with: steps, faults, checks, conditions. Light to import."""

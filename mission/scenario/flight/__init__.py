"""A scenario in flight: built, told what to do, broken on time."""

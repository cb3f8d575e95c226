"""Random traffic against a vehicle that hovers; `make fuzz` runs it at length, `test_fuzz.py` briefly."""

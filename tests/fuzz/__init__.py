"""Random traffic against a vehicle that hovers; `make fuzz` runs it at length, tests/system/test_fuzz.py briefly."""

"""What the pytest plugin does (`pytest_honeyguide.py` has its hooks): flown tests, and scenario files as tests."""

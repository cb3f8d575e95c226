"""The two car documents, trained anew: `python -m bench.cars` (make reproduce-cars)."""

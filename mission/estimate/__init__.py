"""The estimator over recorded sensors."""

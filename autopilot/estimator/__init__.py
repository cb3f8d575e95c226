"""The estimator: samples in, `Estimate` out. `ekf.py` is the whole filter in time order."""

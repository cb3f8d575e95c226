"""A multirotor's numbers from logs of its flights: those with which its kernels predict best what was flown."""

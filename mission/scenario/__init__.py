"""Scenario files: flights written down with what is asked of them, flown in simulated time and judged."""

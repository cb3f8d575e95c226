"""Configuration files read with the place of each key, and what is wrong with them in one sentence."""

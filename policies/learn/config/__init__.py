"""Training configuration: ML-Agents' YAML, its defaults and its flags, and the keys of our own."""

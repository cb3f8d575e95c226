"""Training recipes: YAML files in ML-Agents' new form with our own keys, by the name of their task."""

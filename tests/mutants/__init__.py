"""Small changes to safety-critical code that its unit tests should notice: `make mutants`."""

"""What CONTRIBUTING.md tells to add, added."""

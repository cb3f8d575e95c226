"""The drone that follows its owner."""

"""The policy and its networks: encoders, memories, action distributions."""

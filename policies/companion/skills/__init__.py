"""What a companion can do with one kind of policy each."""

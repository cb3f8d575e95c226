"""What a policy that looks at no image is trained with: a model of the senses, and the vector it is shown."""

"""What a companion knows of the owner and of what stands around, by evidence that is no policy's."""

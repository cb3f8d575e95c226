"""What learning reads: rollouts, replay buffers, demonstrations, tensors of a task."""

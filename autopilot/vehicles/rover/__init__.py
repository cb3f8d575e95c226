"""The rover: a vehicle on wheels, steered by its front wheels or by its sides."""

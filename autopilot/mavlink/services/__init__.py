"""The microservices of the autopilot component: protocols, commands, inputs, files."""

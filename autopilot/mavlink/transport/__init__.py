"""Links and their frames: UDP, TCP, serial, memory, routing, queues."""

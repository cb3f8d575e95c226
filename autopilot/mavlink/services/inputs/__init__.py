"""Setpoints, sticks and measurements that clients send."""

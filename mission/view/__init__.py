"""What people see of a flight: the live page, replays, films."""

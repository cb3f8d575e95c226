"""What is plotted of a flight against time, topic by topic."""

"""The commands that train, judge, show and record policies."""

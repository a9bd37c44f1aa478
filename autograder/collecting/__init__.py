"""Lays what was handed in out for the grader: archives, folders, and the bulk downloads of learning platforms."""

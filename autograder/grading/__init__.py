"""Grading: one submission in a worker process, many on a cluster, and again after a change."""

"""Submissions that are more alike than their exercise makes them."""

"""Lays out hand-ins for the grader, from archives, folders, and the bulk downloads of learning platforms."""

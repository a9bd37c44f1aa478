"""Confining a student's program: what it sees, what it may do, and how it is started, watched and ended."""

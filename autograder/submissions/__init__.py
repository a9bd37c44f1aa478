"""Submissions: reading files and notebooks without trusting them, and which exercises there are."""

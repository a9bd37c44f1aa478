"""The work of notebook cells (write an exercise's file, check it, run commands)."""

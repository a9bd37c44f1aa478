"""The functions of notebook cells: writing an exercise's file, checking it, running commands."""

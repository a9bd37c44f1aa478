"""What notebook cells do: write an exercise's file, check it, run commands, and reading notebook files."""

"""What an author of exercises is given to begin with."""

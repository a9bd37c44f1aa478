"""Templates for authors of new exercises."""

"""The nodes of the official demos in the beginner's tutorials, under the same names."""

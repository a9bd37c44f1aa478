"""The nodes of the official demos that the beginner's tutorials run, under the names that they have there."""

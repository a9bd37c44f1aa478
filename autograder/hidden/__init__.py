"""The hidden suites, a folder an exercise: what it asks for (exercise.toml), its tests (suite.py) and what they share."""

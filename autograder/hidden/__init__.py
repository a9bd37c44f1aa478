"""The hidden suites, one folder for each exercise: what is handed in (exercise.toml), the tests (suite.py), helpers."""

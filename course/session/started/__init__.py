"""Code that is loaded into every program that the session starts: see `sitecustomize.py`."""

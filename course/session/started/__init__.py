"""Code that is loaded into every program started by the session, see `sitecustomize.py`."""

"""`environment/classroom`: JupyterHub for a class on one machine, with each student alone in a box (see `box`)."""

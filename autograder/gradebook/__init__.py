"""nbgrader: the course's configuration and plug-ins, the gradebook, lateness, exports and releases."""

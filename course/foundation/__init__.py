"""The lowest layer: waiting, atomic file replacement, processes, folders, and reading untrusted files."""

"""`course feedback`: what came back from the instructor, in the terminal, in the notebook and as a page."""

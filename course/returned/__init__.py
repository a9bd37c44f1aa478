"""`course feedback`: shows the instructor's feedback in the terminal, in the notebook and as a page."""

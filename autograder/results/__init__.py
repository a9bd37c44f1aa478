"""What grading leaves: the output folder, the students' pages, and what an instructor reads of a class."""

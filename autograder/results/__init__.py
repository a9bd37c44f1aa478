"""The results of grading: the output folder, the students' pages, and what an instructor reads of a class."""

"""The results of grading: the output folder, the students' pages, and an instructor's report on a class."""

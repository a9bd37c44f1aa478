"""Grades for other systems: plug-ins of `nbgrader export` for Canvas, Moodle, and anything that reads a CSV file.

    nbgrader export --exporter autograder.export.CanvasExporter --CanvasExporter.roster=FROM_CANVAS.csv --to canvas.csv
    nbgrader export --exporter autograder.export.MoodleExporter --to moodle.csv
    nbgrader export --exporter autograder.export.CsvExporter --to grades.csv

A grade is the score minus the late penalty.  A submission that waits for marks by hand, has no score yet or was not
handed in gives an empty cell, never 0.  How many there are of each is in the log, and so is every student without a
line in the file.

The modules are in `autograder/gradebook`; these names are what instructors give to nbgrader.
"""

from autograder.gradebook.canvas_export import CanvasExporter
from autograder.gradebook.csv_export import CsvExporter
from autograder.gradebook.moodle_export import MoodleExporter

__all__ = ["CanvasExporter", "CsvExporter", "MoodleExporter"]

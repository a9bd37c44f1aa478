"""The exporters under the names that `nbgrader export --exporter autograder.export.CanvasExporter` is given."""

from autograder.gradebook.export import CanvasExporter, CsvExporter, MoodleExporter

__all__ = ["CanvasExporter", "CsvExporter", "MoodleExporter"]

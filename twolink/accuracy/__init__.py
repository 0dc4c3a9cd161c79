"""Accuracy: references, work-precision diagrams and long-time energy drift."""

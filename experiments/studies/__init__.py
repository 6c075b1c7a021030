"""Accuracy, sensitivity and speed of the package's own parts."""

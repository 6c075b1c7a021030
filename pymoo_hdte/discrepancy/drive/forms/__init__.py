"""Corrections of the forms of laws."""

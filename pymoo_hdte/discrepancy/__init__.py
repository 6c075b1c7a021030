"""Discrepancies of model and measurement: missing effects, validated on records not fitted.

>>> from pymoo_hdte.discrepancy import analyse, read_campaign
>>> analysis = analyse(read_campaign("campaign"))
>>> print(analysis.verdict.status, analysis.next_experiment().description)
>>> analysis.report("report")

A campaign is of a harmonic drive (`read_campaign`); any other machine is a mechanism with its
records (`read_rig`, `MeasuredMechanism`).
"""

from pymoo_hdte._lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)

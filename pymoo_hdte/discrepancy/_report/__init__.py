"""Reports of a verdict: the document, tables, figures and pages."""

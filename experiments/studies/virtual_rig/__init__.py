"""Virtual rigs with hidden effects, to test the discrepancy analysis."""

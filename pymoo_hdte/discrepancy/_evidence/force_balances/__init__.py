"""Evidence of a mechanism: its balances of forces, and the torsion of a joint."""

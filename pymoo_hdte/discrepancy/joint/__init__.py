"""Joints with encoders on both sides of their gear: balance of torques, and torsion."""

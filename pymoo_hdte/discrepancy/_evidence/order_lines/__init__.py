"""Evidence of a harmonic drive: order lines of its records beside the model's."""

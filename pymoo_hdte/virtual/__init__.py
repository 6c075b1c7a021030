"""Rigs that hide effects, with forms and an integrator of their own, for blind campaigns."""

"""Sparse Chebyshev surrogates that find their own degrees, with exact moments of any scatter."""

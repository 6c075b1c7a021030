"""What records say about a model: whitened residuals and what could explain them."""

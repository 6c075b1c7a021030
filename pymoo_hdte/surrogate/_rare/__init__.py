"""Small probabilities: importance sampling in standard normal space, and where to run for them."""

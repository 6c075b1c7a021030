"""What the published numbers say of the drive model, with the covariance that they have."""

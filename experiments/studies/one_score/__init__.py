"""Whether one score of probability decides as well as the verdict's rules do: a pilot beside them."""

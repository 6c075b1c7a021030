"""Whether one score of probability decides as well as the rules of the verdict: a pilot."""

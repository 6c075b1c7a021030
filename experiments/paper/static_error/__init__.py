"""Table 2 and Section 2.1: manufacturing errors and the static error made of them."""

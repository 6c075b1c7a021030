"""From files to checked records in SI units, and what is believed about them."""

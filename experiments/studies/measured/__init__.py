"""Published measurements of machines, compared with what is known of them."""

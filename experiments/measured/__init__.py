"""Machines that others measured, beside what is known of them."""

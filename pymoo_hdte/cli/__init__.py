"""What the command line can do, one module a command; `pymoo_hdte.cli.__main__` calls them."""

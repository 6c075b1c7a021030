"""What the command line can do, one module a command; `pymoo_hdte.cli.command_line` calls them."""

"""Reading and writing: fields and files in TOML, tables, archives."""

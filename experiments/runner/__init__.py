"""What runs experiments: jobs on workers, their store, resume, provenance and the report."""

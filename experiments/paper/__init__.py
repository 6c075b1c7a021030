"""The paper's tables and figures, one module each, beside the published numbers."""

"""Problems of suites, written from the formulas of their papers."""

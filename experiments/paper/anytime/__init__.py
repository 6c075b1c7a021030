"""Table 7 and the ablation at every budget, population and reading of the paper."""

"""Section 4: five prototypes, their records and what the paper's validation can say."""

"""The stored fronts of the robust problems: computed, refined and compared."""

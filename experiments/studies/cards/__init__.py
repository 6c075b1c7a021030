"""Cards of the robust problems: what makes each hard, and how twelve algorithms do on it."""

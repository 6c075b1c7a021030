"""One thread: the matrices are small, so that several threads would be much slower."""

from threadpoolctl import threadpool_limits

ONE_THREAD = threadpool_limits.wrap(limits=1)
"""Decorator of a function that runs on one thread."""

"""One thread for linear algebra of matrices so small that several threads wait for each other."""

from threadpoolctl import threadpool_limits

ONE_THREAD = threadpool_limits.wrap(limits=1)
"""Decorator of a function that runs on one thread; afterwards there are as many as before."""

"""Which parts our swarm has: each left out alone, and all that leave by the protocol's rule."""

"""The swarm family, as pymoo algorithms."""

from pymoo_hdte.algorithms.archive import LeaderArchive
from pymoo_hdte.algorithms.compact import CompactSwarm
from pymoo_hdte.algorithms.elitist import ElitistSwarm
from pymoo_hdte.algorithms.inertia import EntropyWeight, LinearDecrease
from pymoo_hdte.algorithms.interpolated_front import FoundFront, interpolated_front
from pymoo_hdte.algorithms.pyramid import Flat, Pyramid
from pymoo_hdte.algorithms.swarm import ParticleSwarm
from pymoo_hdte.algorithms.variants import AMOPSO, AMPMOPSO, MOPSO, MPMOPSO
from pymoo_hdte.algorithms.velocity import FirstStepWithinBounds, VelocityWithinBounds

__all__ = [
    "AMOPSO",
    "AMPMOPSO",
    "MOPSO",
    "MPMOPSO",
    "CompactSwarm",
    "ElitistSwarm",
    "EntropyWeight",
    "FirstStepWithinBounds",
    "Flat",
    "FoundFront",
    "LeaderArchive",
    "LinearDecrease",
    "ParticleSwarm",
    "Pyramid",
    "VelocityWithinBounds",
    "interpolated_front",
]

"""The family: MOPSO, its two extensions, and the paper's algorithm that has both."""

from __future__ import annotations

from typing import Any

from pymoo_hdte.algorithms.inertia import EntropyWeight, LinearDecrease
from pymoo_hdte.algorithms.pyramid import Flat, Pyramid
from pymoo_hdte.algorithms.swarm import ParticleSwarm


class MOPSO(ParticleSwarm):
    """Basic swarm: inertia weight falling linearly from 0.9 to 0.4, c1 = c2 = 2, no mutation.

    The paper compares with a MOPSO (Table 7) and does not describe it; this one has the archive of
    AMP-MOPSO and none of its strategies. Archive and personal bests are those of Coello Coello,
    Pulido and Lechuga (2004), with crowding in place of their grid and without their mutation.
    Parameters, errors and choices: see
    `ParticleSwarm`.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> len(minimize(get_problem("zdt1"), MOPSO(), ("n_gen", 20), seed=1).F) <= 50
    True
    """

    def __init__(self, pop_size: int = 100, archive_size: int = 50, **kwargs: Any) -> None:
        super().__init__(
            LinearDecrease(), Flat(), pop_size=pop_size, archive_size=archive_size, **kwargs
        )


class AMOPSO(ParticleSwarm):
    """Ablation A-MOPSO (paper, Section 5.2): entropy weight; c1 = c2 = 2, no mutation.

    Parameters, errors and choices: see `ParticleSwarm`.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> len(minimize(get_problem("zdt1"), AMOPSO(), ("n_gen", 20), seed=1).F) <= 50
    True
    """

    def __init__(self, pop_size: int = 100, archive_size: int = 50, **kwargs: Any) -> None:
        super().__init__(
            EntropyWeight(), Flat(), pop_size=pop_size, archive_size=archive_size, **kwargs
        )


class MPMOPSO(ParticleSwarm):
    """Ablation MP-MOPSO (paper, Section 5.2): pyramid; weight falling linearly from 0.9 to 0.4.

    Parameters, errors and choices: see `ParticleSwarm`.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> len(minimize(get_problem("zdt1"), MPMOPSO(), ("n_gen", 20), seed=1).F) <= 50
    True
    """

    def __init__(self, pop_size: int = 100, archive_size: int = 50, **kwargs: Any) -> None:
        super().__init__(
            LinearDecrease(), Pyramid(), pop_size=pop_size, archive_size=archive_size, **kwargs
        )


class AMPMOPSO(ParticleSwarm):
    """AMP-MOPSO as printed in Section 5.1 of the paper: entropy weight and pyramid.

    Parameters and errors: see `ParticleSwarm`. First velocities are drawn within the bounds of the
    positions, as printed; with fewer than 100 particles this decides who is ahead, and
    ``initial_velocity=FirstStepWithinBounds()`` is a law that does not depend on the origin.

    Measured (3 seeds, 100 particles, 100 generations each): the adaptive weight hardly adapts. With
    32 ** m cells nearly every solution of the archive has one of its own, so that the entropy is
    nearly the largest possible. On ZDT1, DTLZ2 and `RobustDTE` the medians of the weight are .421,
    .400 and .414, and it stays below .433 in 86 to 100 % of the generations; on `RobustDTE` it
    reaches .69 within the first ten generations, while the archive fills. The pyramid has two
    layers only, and so is a split in two by rank: 1 and 2 against all others.

    Notes
    -----
    Choices where the paper is silent, besides those that `ParticleSwarm` lists for the family:

    - the entropy grid spans the archive's own objectives; with m objectives it has 32 ** m cells;
    - an archive of one solution, whose normalised entropy would be 0 / 0, counts as 0: w = 0.9;
    - ranks are those of the current swarm, the best being 1;
    - mutation strikes a particle with probability 0.4, in all dimensions at once, and leaves its
      velocity as it is.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems import get_problem
    >>> len(minimize(get_problem("zdt1"), AMPMOPSO(), ("n_gen", 20), seed=1).F) <= 50
    True
    """

    def __init__(self, pop_size: int = 100, archive_size: int = 50, **kwargs: Any) -> None:
        super().__init__(
            EntropyWeight(), Pyramid(), pop_size=pop_size, archive_size=archive_size, **kwargs
        )

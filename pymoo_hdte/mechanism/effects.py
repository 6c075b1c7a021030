"""Effects that ports of a mechanism may have: every registered one that is a law."""

from typing import Any

# The import registers the effects of a drive; some of them are laws, or readings, elsewhere too.
from pymoo_hdte.effects.effect import Effect, known_effects
from pymoo_hdte.effects.law import Behaviour


def law_effects() -> list[Effect]:
    """Return the effects that are laws, at ports or of readings.

    Laws of temperature are left out, and those whose contacts bend in torsion sweeps of a drive
    only: hysteresis says the same at any port.
    """
    laws = [effect for effect in known_effects() if effect.law is not None]
    return [
        effect
        for effect in laws
        if not (getattr(effect.law, "warmed", False) or _bends(effect.law))
    ]


def _bends(law: Any) -> bool:
    return getattr(law, "before_slip", Behaviour.before_slip) is not Behaviour.before_slip

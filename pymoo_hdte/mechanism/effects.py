"""Effects that ports of a mechanism may have: every registered one that is a law."""

# The import registers the effects of a drive; some of them are laws, or readings, elsewhere too.
from pymoo_hdte.drive import effects as _of_drives  # noqa: F401
from pymoo_hdte.effects.effect import Effect, known_effects


def law_effects() -> list[Effect]:
    """Return the effects that are laws, at ports or of readings; none of them of temperature."""
    laws = [one for one in known_effects() if one.law is not None]
    return [one for one in laws if not getattr(one.law, "warmed", False)]

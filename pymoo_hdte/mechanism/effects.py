"""Effects that ports of a mechanism may have: every registered one that is a law."""

from collections.abc import Collection
from typing import Any

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput

# The import registers the effects of a drive; some of them are laws, or readings, elsewhere too.
from pymoo_hdte.effects.effect import Effect, effect_named, known_effects
from pymoo_hdte.effects.law import Behaviour
from pymoo_hdte.mechanism.parts import LawAt


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


def table_of(effect: LawAt) -> dict[str, Any]:
    """Return an effect as the table of a model file, which `read_law` reads back."""
    numbers = effect_named(effect.name).numbers_of(effect.law)
    return {"name": effect.name, "port": effect.port, **numbers}


def read_law(row: Fields, place: str, ports: Collection[str] | None = None) -> LawAt:
    """Return an effect from the table of a model file; its numbers are in SI.

    Parameters
    ----------
    row : Fields
    place : str
        Of the table in the file, for errors.
    ports : collection of str, optional
        That there are; by default a port may have any name.

    Raises
    ------
    InvalidInput
        For a wrong or missing field.
    """
    effect = effect_named(row.choice("name", [known.name for known in law_effects()]))
    port = row.text("port") if ports is None else row.choice("port", ports)
    numbers = {number: row.number(number) for number in effect.quantities if row.has(number)}
    row.finish()
    try:
        return LawAt(effect.name, port, effect.law_of(numbers))
    except InvalidInput as error:
        field = error.field.removeprefix(f"{effect.name}.")
        raise InvalidInput(f"{place}.{field}", error.value, error.allowed) from None


def _bends(law: Any) -> bool:
    return getattr(law, "before_slip", Behaviour.before_slip) is not Behaviour.before_slip

"""Effects, and the register of all known ones.

An effect is defined in one place: its law or other change of a drive, the ports where it makes
sense, its quantities with their units, its sentence, the effects of which it is a special case, and
a guess of its values from the sizes of a machine. Its behaviour (memory, clearance, readings of
sensors) is defined by its law: see `Behaviour`. Registered effects are known to model files, to the
solvers of drives and mechanisms, to verdicts and to reports.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, Protocol

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.effects.guess import Guess, Sizes, check_response
from pymoo_hdte.effects.law import PORTS
from pymoo_hdte.effects.quantities import si_unit, with_unit
from pymoo_hdte.effects.sentence_blanks import check_sentence
from pymoo_hdte.effects.unknowns import number_of

Place = tuple[str, str, float | None]
"""Name, port and order of an effect."""
DRIVE_PORTS = (*PORTS, "sensor")
"""Ports of a drive: places of laws, and the reading of its output angle."""
AS_LISTED = "as_listed"
FORMS: Mapping[str, tuple[str, ...]] = {
    AS_LISTED: DRIVE_PORTS,
    "curve_of_speed": ("input", "output"),
    "curve_of_speed_and_angle": ("input", "output"),
    "power_of_load": ("input",),
    "curve_of_torsion": ("mesh",),
    "slipping_springs": ("mesh",),
    "harmonics_of_torque": ("input", "output", "load"),
    "harmonics_of_stiffness": ("mesh",),
    "harmonics_of_error": ("mesh",),
    "harmonics_of_scale": ("sensor",),
    "lagging_reaction": ("input",),
    "growing_damping": ("mesh",),
    "hanging_load": ("output",),
    "drift_in_time": ("sensor",),
}
"""Families of forms that the law of an effect may have, and the ports of a drive for each.

``"as_listed"`` states that no other form is known. The discrepancy workflow has what each of the
others spans.
"""


class Standing(Protocol):
    """An effect in a model, with its own port and values."""

    @property
    def name(self) -> str:
        """Name of the effect."""
        ...


def place_of(standing: Standing) -> Place:
    """Return the place of an effect in a model, which takes one at each place."""
    law = getattr(standing, "law", standing)
    return standing.name, str(getattr(standing, "port", "")), getattr(law, "order", None)


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect, with everything that the package knows about it.

    Attributes
    ----------
    name : str
        Name in model files and verdicts: lower case with underscores, e.g. ``"coulomb_friction"``.
    law : type or None
        Dataclass of the law, whose fields are numbers in SI; None if it is no law at a port.
    ports : tuple of str
        Ports of a drive where it may be, of ``"input"``, ``"output"``, ``"mesh"``, ``"load"``
        and ``"sensor"``; empty for an effect of other mechanisms only. A law may be at any port of
        a mechanism.
    quantities : mapping of str to str
        For each number its quantity, of `fields.UNITS`, or a unit of SI; empty for a dimensionless
        one. Fields of the law that are not listed here are in no file.
    sentence : str
        Its description in a report, which may contain ``{port}``, ``{order}`` and ``{force}``
        (``"torque"`` in a drive).
    guess : callable or None
        Maps `Sizes` of a port to a list of `Guess`, empty where it is impossible; None: not sought.
    sought : tuple of str or None
        Ports of a drive where it is searched for; by default all of ``ports``.
    change : type or None
        Its type in a drive, where that is no law at a port.
    of_fit : mapping of str to str
        Quantities of unknowns of its guesses that are no numbers of the law.
    special_case_of, contains : tuple of str
        Effects of which this one is a special case, and effects that are special cases of this one:
        Coulomb friction is Stribeck friction without the excess. One that contains another and fits
        no better is not a different explanation. Of one ``"form"`` only: ``"name/form"``.
    exact : bool
        Whether its form is known exactly, so that it must explain records down to the noise; the
        curve of a friction law is only an approximation of a real one.
    exact_at : tuple of str
        Ports of a drive at which its form is known exactly, though it is not elsewhere: what hangs
        at the shaft of a load is one body, what hangs at the axis of a mechanism may fold.
    of_reading : bool
        Whether, in a mechanism, only the reading of a force sensor shows it.
    forms : str
        Family of `FORMS` within which its law in a drive may differ from the listed one, so that
        such a difference is no evidence of another effect; empty is ``"as_listed"``.
    form_of : str
        Effect of which it is another form: where a drive model has one of them, the other is not
        searched for. Empty for none.
    covers : str
        Base parameter of a drive, e.g. ``"load_inertia"``, of which a value beyond its tolerance
        is the same as this effect at the first of ``sought``; empty for none.
    twin : str
        Effect whose line of the transmission error is the same until the disc of the output encoder
        is turned on its shaft; empty for none.
    constant_one_way : bool
        Whether it is like a constant force while a port moves one way only.
    lags : bool
        Whether slow reversals at a few angles show what it is: its force jumps, or lags behind.
    with_load : bool
        Whether the same motion under another load shows what it is.
    slows : bool
        Whether its force grows with the speed, so that ahead of a gear it looks like the delay of
        an encoder.
    behind_gear : bool
        Whether it is searched for at the load of a gear only, not at the shaft ahead of it.
    nuisance_at : tuple of str
        Ports of a drive where its seat is the bench, as that of a brake's ripple: there it is told
        of the bench, and no answer to what is missing in the drive.

    Raises
    ------
    InvalidInput
        For a name that is no such word, neither law nor change, quantities that are no fields of
        the law, an unknown port or family of forms, a family that is for other ports, or a
        sentence that is empty or has an unknown blank.

    Examples
    --------
    >>> from pymoo_hdte.effects import effect_named
    >>> coulomb = effect_named("coulomb_friction")
    >>> coulomb.ports, coulomb.unit("level")
    (('input', 'output'), 'N.m')
    """

    name: str
    law: type[Any] | None
    ports: tuple[str, ...]
    quantities: Mapping[str, str]
    sentence: str
    guess: Callable[[Any], Sequence[Guess]] | None = None
    sought: tuple[str, ...] | None = None
    change: type[Any] | None = None
    of_fit: Mapping[str, str] = field(default_factory=dict)
    special_case_of: tuple[str, ...] = ()
    contains: tuple[str, ...] = ()
    exact: bool = False
    exact_at: tuple[str, ...] = ()
    of_reading: bool = False
    forms: str = ""
    form_of: str = ""
    covers: str = ""
    twin: str = ""
    constant_one_way: bool = False
    lags: bool = False
    with_load: bool = False
    slows: bool = False
    behind_gear: bool = False
    nuisance_at: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z]+(_[a-z]+)*", str(self.name)):
            raise InvalidInput("effect.name", self.name, "words in lower case with underscores")
        if self.law is None and self.change is None:
            raise InvalidInput(f"{self.name}.law", None, "a dataclass with the numbers of a law")
        for port in self.ports:
            one_of(f"{self.name}.ports", port, DRIVE_PORTS)
        for port in self.sought or ():
            one_of(f"{self.name}.sought", port, self.ports)
        if self.remembers and set(self.ports) - {"mesh"}:
            allowed = '("mesh",): solvers keep inner states of laws at the mesh of a drive only'
            raise InvalidInput(f"{self.name}.ports", self.ports, allowed)
        for port in self.nuisance_at:
            one_of(f"{self.name}.nuisance_at", port, self.ports)
        for port in self.exact_at:
            one_of(f"{self.name}.exact_at", port, self.ports)
        for number in self.quantities:
            one_of(f"{self.name}.quantities", number, [field.name for field in fields(self.kind)])
        check_sentence(f"{self.name}.sentence", self.sentence)
        if self.forms:
            allowed_at = FORMS[one_of(f"{self.name}.forms", self.forms, FORMS)]
            for port in self.sought_at:
                one_of(f"{self.name}.sought (with the forms {self.forms})", port, allowed_at)

    @property
    def kind(self) -> type[Any]:
        """Type of the effect in a drive, or else of its law."""
        kind = self.change or self.law
        assert kind is not None
        return kind

    @property
    def sought_at(self) -> tuple[str, ...]:
        """Ports of a drive where it is searched for."""
        return self.ports if self.sought is None else self.sought

    @property
    def is_of_bench(self) -> bool:
        """Whether it is searched for as a nuisance only."""
        return bool(self.sought_at) and set(self.sought_at) <= set(self.nuisance_at)

    @property
    def rattles(self) -> bool:
        """Whether parts may lose contact: see `Behaviour.rattles`."""
        return bool(getattr(self.law, "rattles", False))

    @property
    def remembers(self) -> bool:
        """Whether its law keeps inner states: see `Behaviour.states`."""
        return bool(getattr(self.law, "states", 0))

    @property
    def loaded(self) -> bool:
        """Whether its force depends on what the port passes on: see `Behaviour.loaded`."""
        return bool(getattr(self.law, "loaded", False))

    @property
    def drives(self) -> bool:
        """Whether it is a driving force: see `Behaviour.drives`."""
        return bool(getattr(self.law, "drives", False))

    def guesses(self, sizes: Sizes) -> Sequence[Guess]:
        """Return the forms that it may have, for the sizes of a port; each has to give numbers."""
        for guess in (guesses := [] if self.guess is None else self.guess(sizes)):
            check_response(
                self.name, [part for _, part in self.parts(guess, guess.begins[0])], sizes
            )
        return guesses

    def parts(self, guess: Guess, values: Sequence[float]) -> tuple[tuple[str, Any], ...]:
        """Return laws (or other changes) for the values of a guess, each with its name."""
        if guess.build is None:
            names = [parameter.name for parameter in guess.unknowns]
            return ((self.name, self.kind(**dict(zip(names, values, strict=True)))),)
        return tuple((self._name_of(part), part) for part in guess.build(values))

    def _name_of(self, part: Any) -> str:
        """Return the name of a part: an effect may include the law of another."""
        if any(kind is not None and isinstance(part, kind) for kind in (self.law, self.change)):
            return self.name
        for effect in _EFFECTS.values():
            if type(part) in (effect.law, effect.change):
                return effect.name
        allowed = "laws of registered effects only"
        raise InvalidInput(f"{self.name}.guess", type(part).__name__, allowed)

    def unit(self, unknown: str, of_guess: Mapping[str, str] | None = None) -> str:
        """Return the SI unit of a number, of an unknown of a guess or of a phase; 1 for none.

        An unknown may be a line of any order: ``"second_amplitude"`` is an amplitude. Quantities
        ``of_guess`` come first.
        """
        stated = {"phase": "angle", **self.of_fit, **self.quantities, **(of_guess or {})}
        return si_unit(stated.get(unknown, stated.get(number_of(unknown), "")))

    def law_of(self, values: Mapping[str, float]) -> Any:
        """Return the law with these numbers.

        Parameters
        ----------
        values : mapping of str to float
            In SI; those for which the law has a default may be absent.

        Raises
        ------
        InvalidInput
            Naming the field ``name.number``: for an unknown number, or one that is missing or that
            the law does not take.
        """
        if self.law is None:
            raise InvalidInput(f"{self.name}.law", None, "an effect that is a law at a port")
        for name in values:
            one_of(f"number of {self.name}", name, tuple(self.quantities))
        for number in self.quantities:
            if number not in values and number not in self._defaults:
                allowed = "a finite number (it is missing)"
                raise InvalidInput(f"{self.name}.{number}", None, allowed)
        numbers = {
            name: real_number(f"{self.name}.{name}", value) for name, value in values.items()
        }
        try:
            return self.law(**numbers)
        except InvalidInput as error:
            # A law may have the name of another effect that shares it, or none.
            number = error.field.rpartition(".")[2]
            raise InvalidInput(f"{self.name}.{number}", error.value, error.allowed) from None

    def numbers_of(self, law: Any) -> dict[str, float]:
        """Return the numbers of a law in SI, from which `law_of` makes an equal law.

        Raises
        ------
        InvalidInput
            For a law of another effect.
        """
        if type(law) is not self.law:
            wanted = getattr(self.law, "__name__", "no law")
            raise InvalidInput(f"{self.name}.law", law, f"a {wanted}")
        return {name: float(getattr(law, name)) for name in self.quantities}

    def from_fields(self, table: Fields) -> Any:
        """Return the law, or other change of a drive, from a table of a model file.

        Raises
        ------
        InvalidInput
            For a wrong or missing field.
        """
        values = {
            number: table.quantity(number, quantity) if quantity else table.number(number)
            for number, quantity in self.quantities.items()
            if number not in self._defaults or table.has(number)
        }
        return self.kind(**values)

    def to_fields(self, numbers: Any) -> dict[str, object]:
        """Return the numbers with their units, as `from_fields` reads them, without defaults."""
        values = {number: getattr(numbers, number) for number in self.quantities}
        return {
            number: with_unit(value, self.quantities[number])
            for number, value in values.items()
            if number not in self._defaults or value != self._defaults[number]
        }

    @property
    def _defaults(self) -> dict[str, float]:
        return {
            field.name: field.default for field in fields(self.kind) if field.default is not MISSING
        }


_EFFECTS: dict[str, Effect] = {}


def register(effect: Effect) -> Effect:
    """Make an effect known to model files, simulation, verdicts and reports, once, and return it.

    Raises
    ------
    InvalidInput
        If another effect has its name.
    """
    if _EFFECTS.get(effect.name, effect) is not effect:
        allowed = "a name that no other effect has"
        raise InvalidInput("effect.name", effect.name, allowed)
    _EFFECTS[effect.name] = effect
    return effect


@contextmanager
def registered(*effects: Effect) -> Iterator[None]:
    """Make effects known inside a block only; those of the package that it imports stay known."""
    before = dict(_EFFECTS)
    try:
        for effect in effects:
            register(effect)
        yield
    finally:
        for name, effect in list(_EFFECTS.items()):
            if name not in before and not effect.kind.__module__.startswith("pymoo_hdte."):
                del _EFFECTS[name]


def known_effects() -> tuple[Effect, ...]:
    """Return all effects that are known: those of the package first, in the order of its files."""
    return tuple(_EFFECTS.values())


def effect_named(name: str) -> Effect:
    """Return the effect of a name; raises `InvalidInput` where there is none."""
    return _EFFECTS[one_of("effect.name", name, _EFFECTS)]


def is_contained(name: str, other_name: str) -> bool:
    """Tell whether an effect is a special case of another, both by name, registered or not."""
    this, that = _EFFECTS.get(name), _EFFECTS.get(other_name)
    return (this is not None and other_name in this.special_case_of) or (
        that is not None and name in that.contains
    )

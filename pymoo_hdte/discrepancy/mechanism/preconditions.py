"""What a mechanism and its records must have before anything can be said of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.mechanism.evidence import MeasuredData
from pymoo_hdte.mechanism import Mechanism, Record
from pymoo_hdte.mechanism.balances import balance_names
from pymoo_hdte.mechanism.motion import highest_frequency
from pymoo_hdte.mechanism.working_rate import working_rows


def check_signals(mechanism: Mechanism, records: Sequence[Record]) -> None:
    """Raise `InvalidInput` unless all that a mechanism needs is known and in each record."""
    if not mechanism.ports:
        raise InvalidInput("mechanism.ports", (), "at least one: effects are looked for there")
    if not _scales(mechanism):
        allowed = "none for at least one inertia, stiffness or gain, or only ratios are known"
        raise InvalidInput("tolerances of the mechanism", "on all", allowed)
    needed = (*balance_names(mechanism), *(one.name for one in mechanism.inputs))
    names = [record.name for record in records]
    for record in records:
        if names.count(record.name) > 1:
            raise InvalidInput("record", record.name, "a name of its own for each record")
        for name in needed:
            if name not in record.channels:
                allowed = f"{name} among them: every coordinate, input and force sensor is needed"
                field = f"channels of record {record.name}"
                raise InvalidInput(field, tuple(record.channels), allowed)
        for name in mechanism.coordinates:
            channel = record.channels[name]
            if np.ptp(channel) == 0.0:
                allowed = "a signal that changes; this one is dead"
                raise InvalidInput(f"channel {name} of {record.name}", float(channel[0]), allowed)


def usual_cutoff(mechanism: Mechanism, records: Sequence[Record]) -> float:
    """Return the frequency, Hz, up to which every coordinate stands out of its noise.

    Raises
    ------
    InvalidInput
        See `highest_frequency`.
    """
    found = []
    for record in records:
        for name in mechanism.coordinates:
            noise = record.noise_of(name)
            try:
                found.append(highest_frequency(record.channels[name], record.step, noise))
            except InvalidInput as error:
                field = f"{name} of record {record.name}: {error.field}"
                raise InvalidInput(field, error.value, error.allowed) from None
    return min(found)


def check_sampling(mechanism: Mechanism, records: Sequence[Record], cutoff: float) -> None:
    """Raise `InvalidInput` if a record is too short or too slow for a cutoff in Hz.

    Held-out ones as well: they are judged at the cutoff of the others, when all else is done.
    """
    for record in records:
        working_rows(mechanism, record, cutoff)


def check_scale(data: MeasuredData) -> None:
    """Raise `InvalidInput` if nothing that is known exactly stands out of the noise of data.

    A gain that is known sets the scale only where its input drives the mechanism. Where all is
    known, nothing is left whose scale could be in question.
    """
    if all(one.tolerance == 0.0 for one in data.mechanism.quantities.values()):
        return
    ratio, least = data.known_over_noise(), data.rules.noise_power_ratio
    if not ratio > least:
        known = ", ".join(_scales(data.mechanism))
        raise InvalidInput(
            f"power of the forces that are known exactly ({known}) over that of their noise",
            ratio,
            f"more than {least:g} in a record to be fitted, or only ratios are known: drive "
            "the mechanism, or give an inertia or a stiffness without a tolerance; look at units",
        )


def _scales(mechanism: Mechanism) -> list[str]:
    """Return the quantities that are known exactly and of which all others are ratios."""
    known = [name for name, one in mechanism.quantities.items() if one.tolerance == 0.0]
    return [name for name in known if name.startswith(("inertia", "stiffness", "gain"))]

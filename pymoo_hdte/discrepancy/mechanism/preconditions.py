"""Requirements on a mechanism and its records for an analysis."""

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
    """Raise `InvalidInput` unless a mechanism is complete and each record has its channels."""
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
    """Return the frequency, Hz, up to which every coordinate exceeds its noise.

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
    """Raise `InvalidInput` if a record is too short or sampled too slowly for a cutoff in Hz.

    Held-out ones as well: they are judged later at the cutoff of the others.
    """
    for record in records:
        working_rows(mechanism, record, cutoff)


def check_scale(data: MeasuredData) -> None:
    """Raise `InvalidInput` if no exactly known force exceeds the noise of data.

    A gain that is known sets the scale only where its input drives the mechanism. Where all
    quantities are known, no scale has to be determined.
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
    """Return the exactly known quantities, relative to which all others are determined."""
    known = [name for name, one in mechanism.quantities.items() if one.tolerance == 0.0]
    return [name for name in known if name.startswith(("inertia", "stiffness", "gain"))]

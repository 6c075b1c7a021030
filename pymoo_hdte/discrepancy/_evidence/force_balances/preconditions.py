"""Requirements on a mechanism and its records for an analysis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.mechanism import Mechanism, Record
from pymoo_hdte.mechanism.balances import balance_names
from pymoo_hdte.mechanism.motion import RATE_SLACK, highest_frequency, highest_share
from pymoo_hdte.mechanism.resampling import COARSEST_SHARE, noise_between, refined, share_beyond
from pymoo_hdte.mechanism.working_rate import working_rows


def check_signals(mechanism: Mechanism, records: Sequence[Record]) -> None:
    """Raise `InvalidInput` unless a mechanism is complete and each record has its channels."""
    if not mechanism.ports:
        raise InvalidInput("mechanism.ports", (), "at least one: effects are looked for there")
    if not _scales(mechanism):
        allowed = (
            "none for at least one inertia, stiffness or gain, or only ratios are known; where no "
            "gain is known, leave it out of the only input, and all is told in units of its signal"
        )
        raise InvalidInput("tolerances of the mechanism", "on all", allowed)
    needed = (*balance_names(mechanism), *(signal.name for signal in mechanism.inputs))
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


def usual_cutoff(mechanism: Mechanism, records: Sequence[Record], rules: Rules = RULES) -> float:
    """Return the frequency, Hz, up to which every coordinate exceeds its noise.

    It is at most a tenth of the sampling rate, or a third where a tenth would leave out more than
    `Rules.band_share` of the power of some coordinate and the record is not interpolated.

    Raises
    ------
    InvalidInput
        See `highest_frequency`.
    """
    beyond = (
        share_beyond(record.channels[name], record.step, highest_share(record.step))
        for record in records
        for name in mechanism.coordinates
    )
    coarse = max(beyond) > rules.band_share
    frequencies = []
    for record in records:
        for name in mechanism.coordinates:
            noise = noise_between(record, name) if coarse else record.noise_of(name)
            share = COARSEST_SHARE if coarse and not record.interpolated else highest_share(1.0)
            try:
                frequencies.append(
                    highest_frequency(record.channels[name], record.step, noise, share)
                )
            except InvalidInput as error:
                field = f"{name} of record {record.name}: {error.field}"
                raise InvalidInput(field, error.value, error.allowed) from None
    return min(frequencies)


def fine_enough(records: Sequence[Record], cutoff: float) -> tuple[Record, ...]:
    """Return records with ten samples in a period of the cutoff, interpolated if necessary.

    Raises
    ------
    InvalidInput
        If a record has fewer than three, or fewer than ten and is interpolated already.
    """
    real_number("cutoff", cutoff, above=0.0)
    fine_records = []
    for record in records:
        fine, most = highest_share(record.step), highest_share(record.step, COARSEST_SHARE)
        if cutoff > RATE_SLACK * most:
            raise InvalidInput(
                f"sampling rate of record {record.name}",
                round(1.0 / record.step, 6),
                f"at least {cutoff / COARSEST_SHARE:.4g} Hz, three samples in a period of the "
                f"cutoff of {cutoff:.4g} Hz; or a cutoff of at most {most:.4g} Hz",
            )
        if record.interpolated and cutoff > RATE_SLACK * fine:
            raise InvalidInput(
                f"sampling rate of record {record.name}",
                round(1.0 / record.step, 6),
                f"at least {cutoff / highest_share(1.0):.4g} Hz, ten rows in a period of the "
                f"cutoff of {cutoff:.4g} Hz, because its rows were not measured at even steps; or "
                f"a cutoff of at most {fine:.4g} Hz",
            )
        # Finer than the ratio requires, so that rounding refuses no record afterwards.
        coarse = cutoff > RATE_SLACK * fine
        fine_records.append(refined(record, int(cutoff / fine) + 1) if coarse else record)
    return tuple(fine_records)


def check_sampling(mechanism: Mechanism, records: Sequence[Record], cutoff: float) -> None:
    """Raise `InvalidInput` if a record is too short or sampled too slowly for a cutoff in Hz.

    This includes held-out records, which are compared later at the same cutoff.
    """
    for record in records:
        working_rows(mechanism, record, cutoff)


def check_scale(data: MeasuredData) -> None:
    """Raise `InvalidInput` if no exactly known force exceeds the noise of data.

    A gain that is known sets the scale only where its input drives the mechanism. Where all
    quantities are known, no scale has to be determined.
    """
    if all(quantity.known for quantity in data.mechanism.quantities.values()):
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
    """Return the exactly known quantities that set the scale of all others."""
    known = [name for name, quantity in mechanism.quantities.items() if quantity.known]
    return [name for name in known if name.startswith(("inertia", "stiffness", "gain"))]

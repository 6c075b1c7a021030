"""The next test: the repetition of a record that best separates the remaining hypotheses.

Records repeated at another size, speed or direction, with a scaled motion, are compared by the
difference between the forces of two hypotheses that the mechanism's own quantities could not absorb
(after Hunter and Reiner, Technometrics 7, 1965).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.candidates import turns_back
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import root_mean_square
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.effects.sentence_blanks import in_words
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force

Values = NDArray[np.float64]

SIZES = (0.3, 1.0, 3.0)
RATES = (0.3, 1.0, 3.0)


@dataclass(frozen=True)
class NextTest:
    """A test and its purpose.

    Attributes
    ----------
    record : str
        Training record to be repeated.
    size, rate : float
        Factors on its travel and on the rate at which it is played, so that ``size * rate`` is that
        on its speed; a negative rate is the reverse direction.
    separates : tuple of str
        Hypotheses that it separates.
    separation : float
        Root mean square of the difference, in units of the model's residual; 0 where no size
        applies.
    description : str
    """

    record: str
    size: float
    rate: float
    separates: tuple[str, ...]
    separation: float
    description: str

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {
            "record": self.record,
            "size": self.size,
            "rate": self.rate,
            "separates": list(self.separates),
            "separation": self.separation,
            "description": self.description,
        }


def next_test(finding: MechanismFinding) -> NextTest:
    """Return the test that best resolves what the verdict leaves open."""
    one_way = [
        port.name
        for port in finding.mechanism.ports
        if not port.read and not turns_back(finding.data, port.name)
    ]
    name = finding.data.spectra[0].record.name
    chosen = finding.verdict.chosen
    if one_way:
        return NextTest(
            name,
            1.0,
            -1.0,
            tuple(effect.name for effect in law_effects() if effect.constant_one_way),
            0.0,
            f"Run the same speeds in the reverse direction: the {one_way[0]} moves one way only, "
            "where dry friction looks like a constant force.",
        )
    if finding.verdict.status == "unlisted" and (reversed_inputs := _reversed(finding)):
        text = (
            f"First check the sign of the gain of {' and of '.join(reversed_inputs)}: with the "
            "opposite sign the nominal mechanism alone fits better than any set of effects."
        )
        return NextTest(name, 1.0, 1.0, (), 0.0, text)
    hypothesis = _nearest(finding)
    if chosen is None or hypothesis is None:
        why = {
            "adequate": "an effect too small to be seen may grow with the motion",
            "unlisted": "how the residual grows with the motion shows what it may be",
        }.get(
            finding.verdict.status,
            "no competing hypothesis remains, and this validates the result under new conditions",
        )
        text = f"Repeat {name} {_how(3.0, 1.0)}: {why}."
        return NextTest(name, 3.0, 1.0, (), 0.0, text)
    return _best_repetition(finding, chosen, hypothesis)


def _reversed(finding: MechanismFinding) -> list[str]:
    """Return the inputs whose gain has the wrong sign, as far as the records tell.

    With the opposite sign, the base alone leaves less in every balance than the best set of effects
    does with the stated one.
    """
    verdict = finding.verdict
    best = verdict.base if verdict.chosen is None else verdict.chosen.fit
    unexplained = root_mean_square(finding.data, best.residuals)
    train = [balance.record for balance in finding.data.spectra]
    names = []
    for actuator in finding.mechanism.inputs:
        if actuator.scaled:
            opposite = {f"gain of {actuator.name}": -actuator.gain.value}
            mechanism = finding.mechanism.with_values(opposite, exactly=False)
            data = measured_data(
                mechanism, train, finding.cutoff, finding.data.known, finding.data.rules
            )
            if np.all(root_mean_square(data, fit(data).residuals) < unexplained):
                names.append(actuator.name)
    return names


def _nearest(finding: MechanismFinding) -> Hypothesis | None:
    """Return the hypothesis nearest to the chosen one that differs from it."""
    chosen, near_by = finding.verdict.chosen, finding.data.rules.nearest_rival_ratio
    others = [
        hypothesis
        for hypothesis in (*finding.verdict.equivalent, *finding.verdict.alternatives)
        if chosen is not None and hypothesis.names != chosen.names and hypothesis.fit.effects
    ]
    equivalent = [hypothesis for hypothesis in others if hypothesis in finding.verdict.equivalent]
    close = [
        hypothesis
        for hypothesis in others
        if chosen is not None and hypothesis.fit.chi_square <= near_by * chosen.fit.chi_square
    ]
    return min(equivalent or close, key=lambda hypothesis: hypothesis.bic, default=None)


def _best_repetition(
    finding: MechanismFinding, chosen: Hypothesis, hypothesis: Hypothesis
) -> NextTest:
    best: tuple[float, int, float, float] = (-1.0, 0, 1.0, 1.0)
    for place, size, rate in product(range(len(finding.data.spectra)), SIZES, RATES):
        best = max(
            best, (_separation(finding, chosen, hypothesis, place, size, rate), place, size, rate)
        )
    separation, place, size, rate = best
    name = finding.data.spectra[place].record.name
    models = f"(1) {in_words(chosen.label)} and (2) {in_words(hypothesis.label)}"
    if separation < 1.0:
        description = (
            "No repetition of these records with another travel or at another rate separates "
            f"{models}; that takes another motion."
        )
    else:
        description = (
            f"Repeat {name} {_how(size, rate)}. This separates {models}, whose forces then differ "
            f"by {separation:.2g} times the present residual."
        )
    return NextTest(name, size, rate, (chosen.label, hypothesis.label), separation, description)


def _how(size: float, rate: float) -> str:
    """Return in words how a record is repeated.

    Of a motion that is scaled and played at another rate, the speed changes by both.
    """
    words = []
    if size != 1.0:
        words.append(f"with {size:g} times its travel")
    if rate != 1.0:
        slower = rate < 1.0
        words.append(
            f"{1.0 / rate if slower else rate:.2g} times {'slower' if slower else 'faster'}"
        )
    if not words:
        return "as it was, for longer"
    return f"{', '.join(words)} ({size * rate:.2g} times its speed)"


def _separation(
    finding: MechanismFinding,
    chosen: Hypothesis,
    hypothesis: Hypothesis,
    place: int,
    size: float,
    rate: float,
) -> float:
    """Return the difference of two hypotheses in a repeated record that the base cannot absorb."""
    balance = finding.data.spectra[place]
    power, unexplained = 0.0, finding.unexplained
    for row, name in enumerate(finding.data.names):
        difference = np.zeros(len(balance.time))
        imitated = [np.ones(len(balance.time))]
        for port in finding.mechanism.ports:
            share = (port.name == name) if port.read else port.motion.get(name, 0.0)
            if share:
                motion = balance.ports[port.name]
                position, speed = size * motion.position, size * rate * motion.speed
                imitated += [position, speed, np.gradient(speed)]
                for sign, compared in ((1.0, chosen), (-1.0, hypothesis)):
                    for effect in compared.fit.effects:
                        if effect.port == port.name:
                            scaled = PortMotion(position, speed, motion.load)
                            force = law_force(effect.law, scaled, port.stiffness.value)
                            difference += sign * share * force
        base = np.column_stack(imitated)
        residual = difference - base @ np.linalg.lstsq(base, difference, rcond=None)[0]
        power += float(np.mean(residual**2)) / max(float(unexplained[row]) ** 2, 1e-300)
    return float(np.sqrt(power))

"""Words of reports and documentation in plain language; both print them from here."""

from __future__ import annotations

import re

DRIVE = {
    "DTE": "dynamic transmission error: how far the output of a drive is from where the input, "
    "divided by the ratio, would have it. Here the peak-to-peak over one output turn, in arcsec.",
    "fading": "of Stribeck friction: the speed within which the extra friction of a slow start "
    "dies away.",
    "harmonic balance": "a steady motion found as a sum of sines, without stepping through time.",
    "locked stiffness": "the stiffness seen in a torsion sweep, over the mean stiffness in motion. "
    "With the input locked, the teeth stand in one place; in motion all places are averaged.",
    "nominal": "as stated in your model or data sheet, before parts vary or values are fitted.",
    "order": "how often per turn of the input something repeats: order 2 comes twice a turn.",
    "order line": "the part of a channel that repeats at one order, with its amplitude and phase.",
    "port": "a place where a force acts: input, output, mesh (between the two) and sensor of a "
    "drive; in a mechanism, the relative motion that was given a name.",
    "ripple": "a torque that repeats with the angle, such as a motor's cogging.",
    "theta_s": "size of the static transmission error, the error of the teeth at very slow motion.",
    "torsion": "by how much the drive is twisted, an angle at its output.",
    "torsion sweep": "the input locked, the output torque moved slowly there and back.",
    "wind-up": "torsion under torque; a soft one is softer near zero torque.",
}
VERDICT = {
    "adequate": "a verdict: nothing is missing. The nominal model explains the records within its "
    "tolerances and their noise.",
    "base": "the nominal model alone, fitted within its tolerances, with no effect added.",
    "BIC": "how well a set of effects fits, with a penalty for each unknown; smaller is better. "
    "Only differences count: 10 is strong evidence.",
    "campaign": "all records of one machine, with its noise and its nominal model.",
    "chi-square": "sum of squared misfits in units of their noise; about one per degree of freedom "
    "if the residual is only noise.",
    "class": "a verdict: one of the hypotheses listed is the cause, and these records cannot "
    "distinguish them.",
    "effect": "a law at a port, such as dry friction at the input.",
    "held out": "kept away from every fit, to validate the corrected model.",
    "law": "how a force, torque or error follows from position, speed or temperature.",
    "library": "all effects that are looked for: those of this software, and your own.",
    "misfit": "measured minus predicted, in units of the noise.",
    "named": "a verdict: the effects named explain the records, and no other hypothesis does as "
    "well.",
    "noise floor": "the prediction error that a perfect model would still have.",
    "parameter": "a verdict: no effect is missing, but a nominal value is outside its tolerance.",
    "partial": "a verdict: what is named is missing, but with caveats, such as an unexplained "
    "residual or a value at its bound.",
    "prediction error": "root mean square of measured minus predicted.",
    "record": "one test: a file with time and channels.",
    "repeatability": "how much the error changes from one record to the next when nothing else "
    "does.",
    "residual": "what a fitted model leaves unexplained.",
    "shrinkage": "the share of the prediction error above the noise floor that the correction "
    "removes.",
    "unlisted": "a verdict: something is missing, and no effect in the library explains it.",
}
DESIGN = {
    "box": "all designs that may be chosen: each variable between its two bounds.",
    "dominated": "another design is at least as good in everything and better in something.",
    "front": "the designs that no other design beats in every objective at once.",
    "robust": "good on average and with little scatter, although parts, loads or material vary.",
    "scatter": "how far built parts and conditions of use differ from what was drawn.",
    "Sobol index": "the share of the scatter of a result that one cause alone makes.",
    "surrogate": "a polynomial in the place of the simulator, fitted to some of its runs.",
    "tolerance": "by which share of its value, or between which limits, a part may be off.",
    "utopia distance": "how far a design is from the best value of every objective at once, which "
    "no design has; weights say which objective counts more.",
}
COMPARISON = {
    "evaluation": "one design whose objectives are asked for; what algorithms have to spend.",
    "Holm": "a correction for looking many times: without it, some comparison is lucky.",
    "hypervolume": "the size of what a front dominates, up to a stated point; larger is better. "
    "It counts closeness and spread together.",
    "IGD": "mean distance from points all along the true front to the nearest point found; "
    "smaller is better. It asks for every part of the front.",
    "IGD+": "as IGD, but only what is worse counts as distance.",
    "Spacing": "how unevenly the points found are spaced; 0 is even. It says nothing about how "
    "close they are to the front, so it is never read alone.",
    "true front": "the best that any algorithm could find, known in closed form or computed "
    "without any of the algorithms compared.",
}
GLOSSARY = {
    "Drives and mechanisms": DRIVE,
    "Verdicts on a model": VERDICT,
    "Robust designs": DESIGN,
    "Comparing algorithms": COMPARISON,
}
"""Terms with their meanings, by chapter; terms stand in alphabetical order."""


def terms_of(*chapters: str) -> dict[str, str]:
    """Return the terms of some chapters with their meanings, in alphabetical order."""
    terms = {term: said for chapter in chapters for term, said in GLOSSARY[chapter].items()}
    return dict(sorted(terms.items(), key=lambda entry: entry[0].lower()))


def terms_in(text: str, *chapters: str) -> dict[str, str]:
    """Return the terms of some chapters that a text needs: its own, and those of their meanings.

    A verdict stands in a text as reports show it, with the word before it.

    >>> [*terms_in("Verdict: class. It is at the noise floor.", "Verdicts on a model")]
    ['class', 'noise floor', 'prediction error']
    """
    needed, texts = dict[str, str](), [text]
    every = terms_of(*chapters)
    while texts:
        new = {
            term: said
            for term, said in every.items()
            if term not in needed and any(_stands(term, said, passage) for passage in texts)
        }
        needed |= new
        texts = [*new.values()]
    return {term: said for term, said in every.items() if term in needed}


def _stands(term: str, said: str, text: str) -> bool:
    word = f"Verdict: {term}" if said.startswith("a verdict: ") else re.escape(term)
    return re.search(rf"(?<![\w-]){word}(s|es|ed)?(?![\w-])", text, re.IGNORECASE) is not None

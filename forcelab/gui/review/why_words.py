"""What the explanation of a place says in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forcelab.review.differences import Interval

if TYPE_CHECKING:
    from forcelab.jobs import Progress
    from forcelab.review.explanation import Band, Why
    from forcelab.review.run_result import Outcome

__all__ = ["band", "left", "method", "recogniser", "sentence", "signed", "strongest"]


MINUS = "\N{MINUS SIGN}"


def signed(value: float) -> str:
    """Log-odds with a sign, and as many digits as one reads."""
    shown = f"{abs(value):.1f}" if abs(value) < 99.95 else f"{abs(value):.0f}"
    if not shown.strip("0."):
        return shown
    return (MINUS if value < 0 else "+") + shown


def sentence(place: Interval) -> str:
    """What human and model made of a place: ``0.90 s coded hold, predicted grab with 0.83``."""
    human = place.human or "unlabelled"
    seconds = f"{place.duration:.2f}"
    if place.predicted is None:
        text = "{0} s coded {1}; nothing is predicted"
        return text.format(seconds, human)
    if place.confidence is None:
        text = "{0} s coded {1}, predicted {2}"
        return text.format(seconds, human, place.predicted)
    text = "{0} s coded {1}, predicted {2} with {3}"
    return text.format(seconds, human, place.predicted, f"{place.confidence:.2f}")


def band(one: Band, why: Why) -> str:
    """What one band says: ``normal 2 at 8.1 Hz speaks for grab (+3.1)``."""
    if one.weight >= 0:
        text = "{0} at {1} Hz speaks for {2} ({3})"
    else:
        text = "{0} at {1} Hz speaks against {2} ({3})"
    weight = signed(one.weight)
    if one.error:
        weight += f" ± {one.error:.1f}"
    return text.format(one.channel, f"{one.hertz:.3g}", why.favoured, weight)


def strongest(why: Why) -> str:
    """The three bands that weigh most, a line each."""
    lines = [band(one, why) for one in why.strongest() if one.weight]
    return "\n".join(lines) or "No band makes a difference here."


def method(why: Why) -> str:
    """How it was found out, and how far it can be relied on."""
    found = why.influence
    if found.method == "gradient":
        text = (
            "Log-odds of {0} against {1}: {2} here, {3} at the mean of the training samples. "
            "Gradient along the way from there, over {4} samples; the bands add up to the "
            "difference to within {5}."
        )
        rest = f"{found.gap:.0e}" if found.gap >= 1e-12 else "1e-12"
    else:
        text = (
            "Log-odds of {0} against {1}: {2} here, {3} with every band replaced. Permutation: "
            "what is lost when a band comes from random training samples; {4} samples, {5} "
            "repetitions, ± standard error. Bands that know the same hide each other."
        )
        rest = str(found.repeats)
    return text.format(
        why.favoured,
        why.against,
        signed(found.log_odds),
        signed(found.reference),
        found.steps,
        rest,
    )


def recogniser(why: Why, name: str) -> str:
    """Which recogniser is explained; `name` is the demonstration's."""
    if why.how == "left out":
        text = "The recogniser of the run that has not seen {0}"
    elif why.how == "other task":
        text = "The recogniser of the run, trained on another task than {0}"
    else:
        text = "The final recogniser, which was not trained on {0}"
    told = text.format(name)
    if why.how == "final" or not why.seconds.get("fit"):
        return told + "."
    fit = f"{why.seconds['features'] + why.seconds['fit']:.1f}"
    if why.same == 1:
        again = "trained once more in {0} s: it predicts the same."
        return f"{told}, {again.format(fit)}"
    again = "trained once more in {0} s: {1} % of its samples are the same."
    return f"{told}, {again.format(fit, f'{100 * why.same:.1f}')}"


def left(progress: Progress, name: str, elapsed: float, outcome: Outcome) -> str:
    """How far the training is: ``Training without pen-03 … about 12 s left``."""
    started = f"Training without {name} …"
    seconds, tested = outcome.seconds, max(len(outcome.tested), 1)
    folds = min(outcome.folds or tested, tested)
    usual = seconds.get("features", 0.0) + seconds.get("fit", 0.0) / folds
    rest = usual - elapsed
    if not usual or progress.text == "explaining":
        return started
    if rest < 1:
        return f"Training without {name} … nearly done"
    return "Training without {} … about {} s left".format(name, f"{rest:.0f}")

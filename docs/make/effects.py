"""docs/reference/effects.md: the library of effects that a diagnosis tries."""

from bridge.vehicle.config import load_vehicle
from docs.make.markdown import MADE, code, number, table
from identify.effects.effect import Effect
from identify.effects.library import library

EXAMPLE = "ruvifist:hovering"
ACTED_ON = {
    "force": "forces on the hull",
    "thruster": "what the thrusters give",
    "reading": "what the sensors say",
    "water": "the water around",
    "body": "the rigid body",
    "log": "the recording itself",
}
HEAD = ("parameter", "unit", "least", "most", "absent at", "told as")


def page() -> str:
    file = load_vehicle(EXAMPLE)
    assert file.configuration is not None
    effects = library(file.vehicle.configurations[file.configuration], file.vehicle.thrust_curve.lag_s)
    named = {effect.name: [other for other in effects if other.name == effect.name] for effect in effects}
    sections = "".join(
        f"## {words[0].upper()}{words[1:]}\n\n" + "".join(map(_effect, _of(named, acts_on)))
        for acts_on, words in ACTED_ON.items()
    )
    return (
        f"# Effects\n\n{MADE} What `seatrial diagnose` tries one by one, here for `{EXAMPLE}`: {len(named)} effects in "
        f"{len(effects)} forms. How they are weighed: "
        f"[methods](../methods.md). One more: [add an effect](../howto/add_an_effect.md).\n\n{sections}"
    ).rstrip("\n") + "\n"


def _of(named: dict[str, list[Effect]], acts_on: str) -> list[list[Effect]]:
    return [forms for forms in named.values() if forms[0].acts_on == acts_on]


def _effect(forms: list[Effect]) -> str:
    first = forms[0]
    each = " One for each thruster." if first.number else ""
    lines = [
        f"### `{first.name}`",
        f"{_sentence(first)}{each}",
        f"Told apart by: {'; '.join(first.separation.every)}.",
    ]
    needs = sorted({need for form in forms for need in form.needs})
    if needs:
        some = "" if all(form.needs for form in forms) else " (one of its forms)"
        lines.append(f"Needs in the recording{some}: {', '.join(needs)}.")
    shown, alike = _unlike(forms), len({_made_up_for(form) for form in forms}) == 1
    if alike:
        lines.append(_made_up_for(first))
    for form in shown:
        words = [f"Form: {form.variant}."] if form.variant else []
        words += [] if alike else [_made_up_for(form)]
        rows = [table(HEAD, _parameters(form)).rstrip("\n")] if form.parameters else []
        lines += filter(None, (" ".join(words), *rows))
    return "\n\n".join(lines) + "\n\n"


def _sentence(effect: Effect) -> str:
    text = effect.sentence.replace("thruster 1", "a thruster")
    return f"{text[0].upper()}{text[1:]}."


def _made_up_for(effect: Effect) -> str:
    if effect.refit_absorbs:
        return "A refit of masses and dampings takes it up: it shows beside what was accepted earlier alone."
    if effect.feedforward:
        return "The feed-forward can make up for it, once it is accepted."
    return "The feed-forward can't make up for it: it is told, and kept for other simulators."


def _unlike(forms: list[Effect]) -> list[Effect]:
    """The forms of one thruster, and of those that differ in a period alone the first."""
    kept: dict[str, Effect] = {}
    for form in forms:
        kept.setdefault(" ".join(p.name for p in form.parameters) + _kind(form), form)
    return list(kept.values())


def _kind(form: Effect) -> str:
    return "" if form.variant.endswith(" s") else form.variant


def _parameters(form: Effect) -> list[tuple[str, ...]]:
    units = {
        name: unit for name, (_, unit) in form.answer_parameters(form.start()).items() if name != "thruster"
    }
    same = list(units) == [parameter.name for parameter in form.parameters]
    others = ", ".join(f"`{name}` ({unit})" for name, unit in units.items())
    return [
        (
            code(p.name),
            p.unit,
            number(p.low),
            number(p.high),
            number(p.none) or "no limit",
            code(p.name) if same else others,
        )
        for p in form.parameters
    ]

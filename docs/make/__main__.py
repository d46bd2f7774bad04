"""`python -m docs.make`: write docs/reference and docs/reliability.md anew."""

from pathlib import Path

from docs.make import commands, effects, keys, parameters, reliability

PAGES = {
    "commands.md": commands.page,
    "parameters.md": parameters.page,
    "effects.md": effects.page,
    "keys.md": keys.page,
}
REFERENCE = Path(__file__).resolve().parents[1] / "reference"


def pages() -> dict[str, str]:
    return {name: make() for name, make in PAGES.items()}


if __name__ == "__main__":
    for name, text in pages().items():
        (REFERENCE / name).write_text(text, encoding="utf-8")
    reliability.PAGE.write_text(reliability.page(), encoding="utf-8")

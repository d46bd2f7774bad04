"""One parser fed what coverage leads to: `python guided.py PARSER SECONDS FOLDER`, where atheris is installed.

It ends with 0 where nothing was found; what was found lies in FOLDER.
"""

import random
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["bridge", "gcs_plugin", "pynmeagps", "pyubx2"]):
    from fuzz_streams import STREAMS

LONGEST_BYTES, LONGEST_S, MOST_MB = 4096, 20, 2000
AFRESH_AFTER = 500
SEEDS = 20


def main(name: str, seconds: str, folder: Path) -> None:
    stream = next(one for one in STREAMS if one.name == name)
    feed, fed = stream.make(), 0

    def one(data: bytes) -> None:
        nonlocal feed, fed
        # What is found must not need all that went before it.
        if fed % AFRESH_AFTER == 0:
            feed = stream.make()
        fed += 1
        feed(bytes(data), 0.001 * fed)

    corpus = folder / "corpus"
    corpus.mkdir(parents=True)
    (corpus / "good").write_bytes(stream.good)
    for seed in range(SEEDS):
        (corpus / str(seed)).write_bytes(stream.craft(random.Random(seed)))
    options = {
        "max_total_time": seconds, "max_len": LONGEST_BYTES, "timeout": LONGEST_S, "rss_limit_mb": MOST_MB,
        "artifact_prefix": f"{folder}/", "verbosity": 0,
    }  # fmt: skip
    atheris.Setup([sys.argv[0], str(corpus), *(f"-{key}={value}" for key, value in options.items())], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
